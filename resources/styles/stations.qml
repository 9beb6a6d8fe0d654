<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis styleCategories="Symbology|Labeling|Elevation|Fields|MapTips|AttributeTable" version="3.22.0" labelsEnabled="0">
  <renderer-v2 type="categorizedSymbol" attr="seen">
    <categories>
      <category value="1" symbol="0" label="seen" render="true"/>
      <category value="0" symbol="1" label="not seen" render="true"/>
    </categories>
    <symbols>
      <symbol name="0" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="46,125,79,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="2.2"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="1" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="214,40,57,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="2.2"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
        </layer>
      </symbol>
    </symbols>
  </renderer-v2>
  <aliases>
    <alias field="track_id" index="0" name="Line"/>
    <alias field="guide_id" index="1" name="Guide"/>
    <alias field="s_m" index="2" name="Along the guide [m]"/>
    <alias field="seen" index="3" name="Seen"/>
    <alias field="sigma_mm" index="4" name="Standard error [mm]"/>
    <alias field="sigmaz_mm" index="5" name="Standard error of the height [mm]"/>
    <alias field="bed_m" index="6" name="Height of the bed [m]"/>
    <alias field="cant_mm" index="7" name="Cant [mm]"/>
    <alias field="radius_m" index="8" name="Radius [m]"/>
    <alias field="grade_pm" index="9" name="Gradient [‰]"/>
    <alias field="margin" index="10" name="Margin"/>
    <alias field="reason" index="11" name="Reason"/>
  </aliases>
  <attributetableconfig>
    <columns>
      <column type="field" name="track_id" width="60" hidden="0"/>
      <column type="field" name="guide_id" width="70" hidden="0"/>
      <column type="field" name="s_m" width="190" hidden="0"/>
      <column type="field" name="seen" width="60" hidden="0"/>
      <column type="field" name="sigma_mm" width="190" hidden="0"/>
      <column type="field" name="sigmaz_mm" width="310" hidden="0"/>
      <column type="field" name="bed_m" width="170" hidden="0"/>
      <column type="field" name="cant_mm" width="110" hidden="0"/>
      <column type="field" name="radius_m" width="110" hidden="0"/>
      <column type="field" name="grade_pm" width="130" hidden="0"/>
      <column type="field" name="margin" width="80" hidden="0"/>
      <column type="field" name="reason" width="260" hidden="0"/>
    </columns>
  </attributetableconfig>
  <mapTip>&lt;b&gt;[% format_number(&quot;s_m&quot;, 0) %] m along guide [% &quot;guide_id&quot; %]&lt;/b&gt;&lt;br&gt;Standard error: [% coalesce(format_number(&quot;sigma_mm&quot;, 0) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %]&lt;br&gt;Cant: [% coalesce(format_number(&quot;cant_mm&quot;, 0) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %]&lt;br&gt;[% &quot;reason&quot; %]</mapTip>
  <elevation zoffset="0" zscale="1" clamping="Absolute" binding="Vertex" type="IndividualFeatures" respectLayerSymbol="1"/>
  <layerGeometryType>0</layerGeometryType>
</qgis>
