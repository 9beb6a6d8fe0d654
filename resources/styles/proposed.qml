<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis styleCategories="Symbology|Labeling|Symbology3D|Elevation|Fields|MapTips|AttributeTable" version="3.22.0" labelsEnabled="1">
  <renderer-v2 type="singleSymbol">
    <symbols>
      <symbol name="0" type="line" alpha="1">
        <layer class="SimpleLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="line_color" type="QString" value="142,36,170,255"/>
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
                <Option name="color" type="QString" value="142,36,170,255"/>
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
      <text-style fieldName="'Guide? ' || round(&quot;score&quot;) || ' %'" isExpression="1" fontSize="9" fontSizeUnit="Point" fontWeight="63" textColor="106,27,154,255" textOpacity="1">
        <text-buffer bufferDraw="1" bufferSize="0.9" bufferSizeUnits="MM" bufferColor="255,255,255,255" bufferOpacity="1"/>
      </text-style>
      <placement placement="2" placementFlags="9" dist="0" distUnits="MM" repeatDistance="180" repeatDistanceUnits="MM" priority="5"/>
      <rendering drawLabels="1" obstacle="1" fontMaxPixelSize="10000" maxNumLabels="2000"/>
    </settings>
  </labeling>
  <renderer-3d type="vector" layer="">
    <symbol type="line" material_type="simpleline">
      <data alt-clamping="absolute" alt-binding="vertex" height="0" extrusion-height="0" simple-lines="1" width="2"/>
      <material ambient="142,36,170,255"/>
    </symbol>
  </renderer-3d>
  <aliases>
    <alias field="guide_id" index="0" name="Proposal"/>
    <alias field="score" index="1" name="Score [%]"/>
    <alias field="length_m" index="2" name="Length [m]"/>
  </aliases>
  <attributetableconfig>
    <columns>
      <column type="field" name="guide_id" width="110" hidden="0"/>
      <column type="field" name="score" width="120" hidden="0"/>
      <column type="field" name="length_m" width="120" hidden="0"/>
    </columns>
  </attributetableconfig>
  <mapTip>&lt;b&gt;Proposal [% &quot;guide_id&quot; %]&lt;/b&gt;&lt;br&gt;Score: [% format_number(&quot;score&quot;, 0) %] %&lt;br&gt;Length: [% format_number(&quot;length_m&quot;, 0) %] m</mapTip>
  <elevation zoffset="0" zscale="1" clamping="Absolute" binding="Vertex" type="IndividualFeatures" respectLayerSymbol="1"/>
  <layerGeometryType>1</layerGeometryType>
</qgis>
