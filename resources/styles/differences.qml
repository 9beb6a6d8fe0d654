<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis styleCategories="Symbology|Elevation|Fields|MapTips|AttributeTable" version="3.22.0">
  <renderer-v2 type="categorizedSymbol" attr="CASE WHEN &quot;state&quot; &lt;&gt; 'both' THEN &quot;state&quot; WHEN &quot;moved&quot; = 1 THEN 'moved' WHEN &quot;shifted&quot; = 1 THEN 'shifted' ELSE 'still' END">
    <categories>
      <category value="moved" symbol="0" label="moved by more than three standard errors" render="true"/>
      <category value="shifted" symbol="4" label="shifted with all lines, not moved otherwise" render="true"/>
      <category value="still" symbol="1" label="not moved" render="true"/>
      <category value="missing" symbol="2" label="missing in the other survey" render="true"/>
      <category value="extra" symbol="3" label="not in the reference" render="true"/>
    </categories>
    <symbols>
      <symbol name="0" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="178,24,43,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="2.4"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="1" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="77,160,90,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="1.8"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="2" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="square"/>
            <Option name="color" type="QString" value="242,142,43,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="2"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="3" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="triangle"/>
            <Option name="color" type="QString" value="142,91,181,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="2"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="4" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="63,142,196,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="1.8"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
        </layer>
      </symbol>
    </symbols>
  </renderer-v2>
  <aliases>
    <alias field="line_id" index="0" name="Line"/>
    <alias field="input_id" index="1" name="Line of the other survey"/>
    <alias field="chainage_m" index="2" name="Chainage [m]"/>
    <alias field="state" index="3" name="State"/>
    <alias field="across_mm" index="4" name="Across [mm]"/>
    <alias field="height_mm" index="5" name="Height [mm]"/>
    <alias field="gauge_mm" index="6" name="Gauge, difference [mm]"/>
    <alias field="cant_mm" index="7" name="Cant, difference [mm]"/>
    <alias field="sigma_mm" index="8" name="Standard error across [mm]"/>
    <alias field="sigmaz_mm" index="9" name="Standard error of the height [mm]"/>
    <alias field="shift_mm" index="10" name="Constant shift across [mm]"/>
    <alias field="shiftz_mm" index="11" name="Constant shift in height [mm]"/>
    <alias field="moved" index="12" name="Moved"/>
    <alias field="shifted" index="13" name="Shifted"/>
  </aliases>
  <attributetableconfig>
    <columns>
      <column type="field" name="line_id" width="60" hidden="0"/>
      <column type="field" name="input_id" width="230" hidden="0"/>
      <column type="field" name="chainage_m" width="130" hidden="0"/>
      <column type="field" name="state" width="70" hidden="0"/>
      <column type="field" name="across_mm" width="120" hidden="0"/>
      <column type="field" name="height_mm" width="120" hidden="0"/>
      <column type="field" name="gauge_mm" width="220" hidden="0"/>
      <column type="field" name="cant_mm" width="210" hidden="0"/>
      <column type="field" name="sigma_mm" width="250" hidden="0"/>
      <column type="field" name="sigmaz_mm" width="310" hidden="0"/>
      <column type="field" name="shift_mm" width="250" hidden="0"/>
      <column type="field" name="shiftz_mm" width="280" hidden="0"/>
      <column type="field" name="moved" width="70" hidden="0"/>
      <column type="field" name="shifted" width="80" hidden="0"/>
    </columns>
  </attributetableconfig>
  <mapTip>&lt;b&gt;Line [% &quot;line_id&quot; %], [% &quot;chainage_m&quot; %] m: [% &quot;state&quot; %]&lt;/b&gt;&lt;br&gt;across [% coalesce(&quot;across_mm&quot;, '?') %] mm, height [% coalesce(&quot;height_mm&quot;, '?') %] mm&lt;br&gt;standard errors [% coalesce(&quot;sigma_mm&quot;, '?') %] and [% coalesce(&quot;sigmaz_mm&quot;, '?') %] mm</mapTip>
  <elevation zoffset="0" zscale="1" clamping="Absolute" binding="Vertex" type="IndividualFeatures" respectLayerSymbol="1"/>
  <layerGeometryType>0</layerGeometryType>
</qgis>
