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
    <alias field="track_id" index="0" name="Line"/>
    <alias field="guide_id" index="1" name="Guide"/>
    <alias field="length_m" index="2" name="Length [m]"/>
    <alias field="seen_m" index="3" name="Seen [m]"/>
    <alias field="sigma_mm" index="4" name="Standard error [mm]"/>
    <alias field="sigmaz_mm" index="5" name="Standard error of the height [mm]"/>
    <alias field="gauge_mm" index="6" name="Gauge looked for [mm]"/>
    <alias field="name" index="7" name="Name"/>
    <alias field="ref" index="8" name="Reference"/>
    <alias field="hint" index="9" name="Only a hint"/>
  </aliases>
  <attributetableconfig>
    <columns>
      <column type="field" name="track_id" width="60" hidden="0"/>
      <column type="field" name="guide_id" width="70" hidden="0"/>
      <column type="field" name="length_m" width="110" hidden="0"/>
      <column type="field" name="seen_m" width="100" hidden="0"/>
      <column type="field" name="sigma_mm" width="190" hidden="0"/>
      <column type="field" name="sigmaz_mm" width="310" hidden="0"/>
      <column type="field" name="gauge_mm" width="210" hidden="0"/>
      <column type="field" name="name" width="160" hidden="0"/>
      <column type="field" name="ref" width="110" hidden="0"/>
      <column type="field" name="hint" width="150" hidden="0"/>
    </columns>
  </attributetableconfig>
  <mapTip>&lt;b&gt;[% &quot;ref&quot; %] [% &quot;name&quot; %]&lt;/b&gt;&lt;br&gt;Length: [% format_number(&quot;length_m&quot;, 1) %] m&lt;br&gt;Seen: [% format_number(&quot;seen_m&quot;, 0) %] m&lt;br&gt;Standard error: [% format_number(&quot;sigma_mm&quot;, 0) %] mm</mapTip>
  <elevation zoffset="0" zscale="1" clamping="Absolute" binding="Vertex" type="IndividualFeatures" respectLayerSymbol="1"/>
  <layerGeometryType>1</layerGeometryType>
</qgis>
