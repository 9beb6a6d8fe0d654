<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis styleCategories="Symbology|Labeling|Elevation|Fields|MapTips|AttributeTable" version="3.22.0" labelsEnabled="1">
  <renderer-v2 type="singleSymbol">
    <symbols>
      <symbol name="0" type="line" alpha="1">
        <layer class="SimpleLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="line_color" type="QString" value="142,91,181,255"/>
            <Option name="line_width" type="QString" value="0.8"/>
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
      <text-style fieldName="&quot;name&quot; || coalesce(&#x27; km &#x27; || format_number(&quot;km_from&quot;, 3), &#x27;&#x27;)" isExpression="1" fontSize="8" fontSizeUnit="Point" textColor="106,27,154,255" textOpacity="1">
        <text-buffer bufferDraw="1" bufferSize="0.8" bufferSizeUnits="MM" bufferColor="255,255,255,255" bufferOpacity="1"/>
      </text-style>
      <placement placement="2" placementFlags="10" dist="1" distUnits="MM" priority="5"/>
      <rendering drawLabels="1" obstacle="1" fontMaxPixelSize="10000" maxNumLabels="2000"/>
    </settings>
  </labeling>
  <aliases>
    <alias field="track_id" index="0" name="Track"/>
    <alias field="name" index="1" name="Name in the file"/>
    <alias field="length_m" index="2" name="Length [m]"/>
    <alias field="km_from" index="3" name="Kilometre of the start"/>
    <alias field="km_to" index="4" name="Kilometre of the end"/>
  </aliases>
  <attributetableconfig>
    <columns>
      <column type="field" name="track_id" width="70" hidden="0"/>
      <column type="field" name="name" width="160" hidden="0"/>
      <column type="field" name="length_m" width="110" hidden="0"/>
      <column type="field" name="km_from" width="220" hidden="0"/>
      <column type="field" name="km_to" width="200" hidden="0"/>
    </columns>
  </attributetableconfig>
  <mapTip>&lt;b&gt;[% &quot;name&quot; %]&lt;/b&gt;&lt;br&gt;Track [% &quot;track_id&quot; %]&lt;br&gt;Length: [% format_number(&quot;length_m&quot;, 1) || &#x27; m&#x27; %]&lt;br&gt;Kilometre: [% coalesce(format_number(&quot;km_from&quot;, 3) || &#x27; to &#x27; || format_number(&quot;km_to&quot;, 3), &#x27;unknown&#x27;) %]</mapTip>
  <elevation zoffset="0" zscale="1" clamping="Absolute" binding="Vertex" type="IndividualFeatures" respectLayerSymbol="1"/>
  <layerGeometryType>1</layerGeometryType>
</qgis>
