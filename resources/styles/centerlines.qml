<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis styleCategories="Symbology|Labeling|Symbology3D|Elevation|Fields|MapTips|AttributeTable" version="3.22.0" labelsEnabled="1">
  <renderer-v2 type="singleSymbol">
    <symbols>
      <symbol name="0" type="line" alpha="1">
        <layer class="SimpleLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="line_color" type="QString" value="230,74,25,255"/>
            <Option name="line_width" type="QString" value="0.4"/>
            <Option name="line_width_unit" type="QString" value="MM"/>
            <Option name="line_style" type="QString" value="dash"/>
            <Option name="capstyle" type="QString" value="round"/>
            <Option name="joinstyle" type="QString" value="round"/>
          </Option>
        </layer>
        <layer class="MarkerLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="placement" type="QString" value="interval"/>
            <Option name="interval" type="QString" value="60"/>
            <Option name="interval_unit" type="QString" value="MM"/>
            <Option name="offset_along_line" type="QString" value="25"/>
            <Option name="offset_along_line_unit" type="QString" value="MM"/>
            <Option name="rotate" type="QString" value="1"/>
          </Option>
          <symbol name="@0@1" type="marker" alpha="1">
            <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
              <Option type="Map">
                <Option name="name" type="QString" value="filled_arrowhead"/>
                <Option name="color" type="QString" value="230,74,25,255"/>
                <Option name="outline_style" type="QString" value="no"/>
                <Option name="size" type="QString" value="3.2"/>
                <Option name="size_unit" type="QString" value="MM"/>
              </Option>
            </layer>
          </symbol>
        </layer>
      </symbol>
    </symbols>
  </renderer-v2>
  <labeling type="simple">
    <settings calloutType="simple">
      <text-style fieldName="'Track ' || &quot;track_id&quot;" isExpression="1" fontSize="9" fontSizeUnit="Point" fontWeight="63" textColor="181,54,11,255" textOpacity="1">
        <text-buffer bufferDraw="1" bufferSize="0.9" bufferSizeUnits="MM" bufferColor="255,255,255,255" bufferOpacity="1"/>
      </text-style>
      <placement placement="2" placementFlags="9" dist="0" distUnits="MM" repeatDistance="180" repeatDistanceUnits="MM" priority="5"/>
      <rendering drawLabels="1" obstacle="1" fontMaxPixelSize="10000" maxNumLabels="2000"/>
    </settings>
  </labeling>
  <renderer-3d type="vector" layer="">
    <symbol type="line" material_type="simpleline">
      <data alt-clamping="absolute" alt-binding="vertex" height="0" extrusion-height="0" simple-lines="1" width="2"/>
      <material ambient="230,74,25,255"/>
    </symbol>
  </renderer-3d>
  <aliases>
    <alias field="track_id" index="0" name="Track"/>
    <alias field="class_code" index="1" name="Class"/>
    <alias field="left_ids" index="2" name="Left rails"/>
    <alias field="right_ids" index="3" name="Right rails"/>
    <alias field="length_m" index="4" name="Length [m]"/>
    <alias field="gauge_mm" index="5" name="Gauge, mean [mm]"/>
    <alias field="gaugesd_mm" index="6" name="Gauge, standard deviation [mm]"/>
    <alias field="cant_mm" index="7" name="Cant, mean [mm]"/>
    <alias field="cantmax_mm" index="8" name="Cant, largest [mm]"/>
    <alias field="bridged_m" index="9" name="Without points [m]"/>
  </aliases>
  <attributetableconfig>
    <columns>
      <column type="field" name="track_id" width="70" hidden="0"/>
      <column type="field" name="class_code" width="70" hidden="0"/>
      <column type="field" name="left_ids" width="110" hidden="0"/>
      <column type="field" name="right_ids" width="120" hidden="0"/>
      <column type="field" name="length_m" width="110" hidden="0"/>
      <column type="field" name="gauge_mm" width="170" hidden="0"/>
      <column type="field" name="gaugesd_mm" width="280" hidden="0"/>
      <column type="field" name="cant_mm" width="160" hidden="0"/>
      <column type="field" name="cantmax_mm" width="180" hidden="0"/>
      <column type="field" name="bridged_m" width="180" hidden="0"/>
    </columns>
  </attributetableconfig>
  <mapTip>&lt;b&gt;Track [% &quot;track_id&quot; %]&lt;/b&gt;&lt;br&gt;Gauge: [% coalesce(format_number(&quot;gauge_mm&quot;, 1) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %]&lt;br&gt;Cant: [% coalesce(format_number(&quot;cant_mm&quot;, 1) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %]&lt;br&gt;Length: [% coalesce(format_number(&quot;length_m&quot;, 1) || &#x27; m&#x27;, &#x27;unknown&#x27;) %]&lt;br&gt;Without points: [% coalesce(format_number(&quot;bridged_m&quot;, 1) || &#x27; m&#x27;, &#x27;unknown&#x27;) %]</mapTip>
  <elevation zoffset="0" zscale="1" clamping="Absolute" binding="Vertex" type="IndividualFeatures" respectLayerSymbol="1"/>
  <layerGeometryType>1</layerGeometryType>
</qgis>
