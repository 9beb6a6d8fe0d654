<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis styleCategories="Symbology|Elevation|Fields|MapTips|AttributeTable" version="3.22.0">
  <renderer-v2 type="graduatedSymbol" attr="slew_mm" graduatedMethod="GraduatedColor">
    <ranges>
      <range lower="-100000" upper="-10" symbol="0" label="more than 10 mm to the right of the design" render="true"/>
      <range lower="-10" upper="-5" symbol="1" label="5 to 10 mm to the right" render="true"/>
      <range lower="-5" upper="5" symbol="2" label="slew within 5 mm" render="true"/>
      <range lower="5" upper="10" symbol="3" label="5 to 10 mm to the left" render="true"/>
      <range lower="10" upper="100000" symbol="4" label="more than 10 mm to the left" render="true"/>
    </ranges>
    <symbols>
      <symbol name="0" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="33,102,172,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="2"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="1" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="103,169,207,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="2"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="2" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="77,160,90,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
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
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="239,138,98,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
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
            <Option name="color" type="QString" value="178,24,43,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="2"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
        </layer>
      </symbol>
    </symbols>
    <classificationMethod id="Custom"/>
  </renderer-v2>
  <aliases>
    <alias field="track_id" index="0" name="Track"/>
    <alias field="s" index="1" name="Distance along the design [m]"/>
    <alias field="slew_mm" index="2" name="Slew [mm]"/>
    <alias field="lift_mm" index="3" name="Lift [mm]"/>
    <alias field="cant_diff_mm" index="4" name="Cant, measured minus design [mm]"/>
  </aliases>
  <attributetableconfig>
    <columns>
      <column type="field" name="track_id" width="70" hidden="0"/>
      <column type="field" name="s" width="280" hidden="0"/>
      <column type="field" name="slew_mm" width="110" hidden="0"/>
      <column type="field" name="lift_mm" width="110" hidden="0"/>
      <column type="field" name="cant_diff_mm" width="300" hidden="0"/>
    </columns>
  </attributetableconfig>
  <mapTip>&lt;b&gt;Track [% &quot;track_id&quot; %], [% format_number(&quot;s&quot;, 0) %] m&lt;/b&gt;&lt;br&gt;Slew: [% format_number(&quot;slew_mm&quot;, 1) || &#x27; mm&#x27; %]&lt;br&gt;Lift: [% coalesce(format_number(&quot;lift_mm&quot;, 1) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %]&lt;br&gt;Cant, measured minus design: [% coalesce(format_number(&quot;cant_diff_mm&quot;, 1) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %]</mapTip>
  <elevation zoffset="0" zscale="1" clamping="Absolute" binding="Vertex" type="IndividualFeatures" respectLayerSymbol="1"/>
  <layerGeometryType>0</layerGeometryType>
</qgis>
