<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis styleCategories="Symbology|Labeling|Elevation|Fields|MapTips|AttributeTable" version="3.22.0" labelsEnabled="1">
  <renderer-v2 type="singleSymbol">
    <symbols>
      <symbol name="0" type="line" alpha="1">
        <layer class="SimpleLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="line_color" type="QString" value="0,131,143,255"/>
            <Option name="line_width" type="QString" value="0.9"/>
            <Option name="line_width_unit" type="QString" value="MM"/>
            <Option name="line_style" type="QString" value="solid"/>
            <Option name="capstyle" type="QString" value="flat"/>
            <Option name="joinstyle" type="QString" value="round"/>
          </Option>
        </layer>
      </symbol>
    </symbols>
  </renderer-v2>
  <labeling type="simple">
    <settings calloutType="simple">
      <text-style fieldName="round(&quot;offset_mm&quot;) || &#x27; / &#x27; || round(&quot;height_mm&quot;)" isExpression="1" fontSize="8" fontSizeUnit="Point" textColor="0,96,100,255" textOpacity="1">
        <text-buffer bufferDraw="1" bufferSize="0.9" bufferSizeUnits="MM" bufferColor="255,255,255,255" bufferOpacity="1"/>
      </text-style>
      <placement placement="2" placementFlags="10" dist="2" distUnits="MM" priority="7"/>
      <rendering drawLabels="1" obstacle="1" fontMaxPixelSize="10000" maxNumLabels="2000"/>
    </settings>
  </labeling>
  <aliases>
    <alias field="platform" index="0" name="Platform"/>
    <alias field="track_id" index="1" name="Track"/>
    <alias field="side" index="2" name="Side"/>
    <alias field="from_m" index="3" name="From [m]"/>
    <alias field="to_m" index="4" name="To [m]"/>
    <alias field="length_m" index="5" name="Length [m]"/>
    <alias field="offset_mm" index="6" name="Offset [mm]"/>
    <alias field="offmin_mm" index="7" name="Least offset [mm]"/>
    <alias field="offmax_mm" index="8" name="Largest offset [mm]"/>
    <alias field="height_mm" index="9" name="Height, mean [mm]"/>
    <alias field="hmin_mm" index="10" name="Least height [mm]"/>
    <alias field="hmax_mm" index="11" name="Largest height [mm]"/>
    <alias field="nominal_mm" index="12" name="Nominal height [mm]"/>
    <alias field="sigma_mm" index="13" name="Standard error [mm]"/>
    <alias field="sigmaz_mm" index="14" name="Standard error of the height [mm]"/>
    <alias field="km_from" index="15" name="From kilometre"/>
    <alias field="km_to" index="16" name="To kilometre"/>
  </aliases>
  <attributetableconfig>
    <columns>
      <column type="field" name="platform" width="90" hidden="0"/>
      <column type="field" name="track_id" width="60" hidden="0"/>
      <column type="field" name="side" width="60" hidden="0"/>
      <column type="field" name="from_m" width="90" hidden="0"/>
      <column type="field" name="to_m" width="70" hidden="0"/>
      <column type="field" name="length_m" width="110" hidden="0"/>
      <column type="field" name="offset_mm" width="120" hidden="0"/>
      <column type="field" name="offmin_mm" width="180" hidden="0"/>
      <column type="field" name="offmax_mm" width="200" hidden="0"/>
      <column type="field" name="height_mm" width="180" hidden="0"/>
      <column type="field" name="hmin_mm" width="180" hidden="0"/>
      <column type="field" name="hmax_mm" width="200" hidden="0"/>
      <column type="field" name="nominal_mm" width="200" hidden="0"/>
      <column type="field" name="sigma_mm" width="200" hidden="0"/>
      <column type="field" name="sigmaz_mm" width="340" hidden="0"/>
      <column type="field" name="km_from" width="150" hidden="0"/>
      <column type="field" name="km_to" width="130" hidden="0"/>
    </columns>
  </attributetableconfig>
  <mapTip>&lt;b&gt;Platform [% &quot;platform&quot; %]&lt;/b&gt;&lt;br&gt;Offset: [% coalesce(format_number(&quot;offset_mm&quot;, 1) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %]&lt;br&gt;Height: [% coalesce(format_number(&quot;height_mm&quot;, 1) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %]</mapTip>
  <elevation zoffset="0" zscale="1" clamping="Absolute" binding="Vertex" type="IndividualFeatures" respectLayerSymbol="1"/>
  <layerGeometryType>1</layerGeometryType>
</qgis>
