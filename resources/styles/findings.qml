<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis styleCategories="Symbology|Labeling|Symbology3D|Elevation|Fields|MapTips|Forms|AttributeTable" version="3.22.0" labelsEnabled="1">
  <renderer-v2 type="categorizedSymbol" attr="coalesce(&quot;review&quot;, '')">
    <categories>
      <category type="string" value="" symbol="0" label="open" render="true"/>
      <category type="string" value="accepted" symbol="1" label="accepted" render="true"/>
      <category type="string" value="rejected" symbol="2" label="rejected" render="true"/>
    </categories>
    <symbols>
      <symbol name="0" type="line" alpha="1">
        <layer class="SimpleLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="line_color" type="QString" value="214,40,57,150"/>
            <Option name="line_width" type="QString" value="3.2"/>
            <Option name="line_width_unit" type="QString" value="MM"/>
            <Option name="line_style" type="QString" value="solid"/>
            <Option name="capstyle" type="QString" value="round"/>
            <Option name="joinstyle" type="QString" value="round"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="1" type="line" alpha="1">
        <layer class="SimpleLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="line_color" type="QString" value="46,125,79,150"/>
            <Option name="line_width" type="QString" value="3.2"/>
            <Option name="line_width_unit" type="QString" value="MM"/>
            <Option name="line_style" type="QString" value="solid"/>
            <Option name="capstyle" type="QString" value="round"/>
            <Option name="joinstyle" type="QString" value="round"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="2" type="line" alpha="1">
        <layer class="SimpleLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="line_color" type="QString" value="120,120,120,150"/>
            <Option name="line_width" type="QString" value="3.2"/>
            <Option name="line_width_unit" type="QString" value="MM"/>
            <Option name="line_style" type="QString" value="solid"/>
            <Option name="capstyle" type="QString" value="round"/>
            <Option name="joinstyle" type="QString" value="round"/>
          </Option>
        </layer>
      </symbol>
    </symbols>
  </renderer-v2>
  <labeling type="simple">
    <settings calloutType="simple">
      <text-style fieldName="finding" isExpression="0" fontSize="9" fontSizeUnit="Point" fontWeight="63" textColor="150,20,35,255" textOpacity="1">
        <text-buffer bufferDraw="1" bufferSize="0.9" bufferSizeUnits="MM" bufferColor="255,255,255,255" bufferOpacity="1"/>
      </text-style>
      <placement placement="2" placementFlags="9" dist="0" distUnits="MM" priority="7"/>
      <rendering drawLabels="1" obstacle="1" fontMaxPixelSize="10000" maxNumLabels="2000"/>
    </settings>
  </labeling>
  <renderer-3d type="vector" layer="">
    <symbol type="line" material_type="simpleline">
      <data alt-clamping="absolute" alt-binding="vertex" height="0" extrusion-height="0" simple-lines="1" width="6"/>
      <material ambient="214,40,57,255"/>
    </symbol>
  </renderer-3d>
  <fieldConfiguration>
    <field name="review">
      <editWidget type="ValueMap">
        <config>
          <Option type="Map">
            <Option name="map" type="List">
              <Option type="Map"><Option name="open" type="QString" value=""/></Option>
              <Option type="Map"><Option name="accepted" type="QString" value="accepted"/></Option>
              <Option type="Map"><Option name="rejected" type="QString" value="rejected"/></Option>
            </Option>
          </Option>
        </config>
      </editWidget>
    </field>
  </fieldConfiguration>
  <aliases>
    <alias field="finding" index="0" name="Finding"/>
    <alias field="reason" index="1" name="Reason"/>
    <alias field="track_id" index="2" name="Track"/>
    <alias field="rail_id" index="3" name="Lone rail"/>
    <alias field="from_m" index="4" name="From [m]"/>
    <alias field="to_m" index="5" name="To [m]"/>
    <alias field="doubt_m" index="6" name="In doubt [m]"/>
    <alias field="worst_m" index="7" name="Worst place [m]"/>
    <alias field="gauge_mm" index="8" name="Gauge there [mm]"/>
    <alias field="cant_mm" index="9" name="Cant there [mm]"/>
    <alias field="sigma_mm" index="10" name="Standard error there [mm]"/>
    <alias field="sigmaz_mm" index="11" name="Standard error of the height there [mm]"/>
    <alias field="points" index="12" name="Points"/>
    <alias field="review" index="13" name="Review"/>
    <alias field="km" index="14" name="Kilometre there"/>
    <alias field="km_text" index="15" name="Kilometre there as text"/>
  </aliases>
  <attributetableconfig>
    <columns>
      <column type="field" name="finding" width="90" hidden="0"/>
      <column type="field" name="reason" width="260" hidden="0"/>
      <column type="field" name="track_id" width="70" hidden="0"/>
      <column type="field" name="rail_id" width="110" hidden="0"/>
      <column type="field" name="from_m" width="100" hidden="0"/>
      <column type="field" name="to_m" width="80" hidden="0"/>
      <column type="field" name="doubt_m" width="130" hidden="0"/>
      <column type="field" name="worst_m" width="160" hidden="0"/>
      <column type="field" name="gauge_mm" width="160" hidden="0"/>
      <column type="field" name="cant_mm" width="160" hidden="0"/>
      <column type="field" name="sigma_mm" width="240" hidden="0"/>
      <column type="field" name="sigmaz_mm" width="360" hidden="0"/>
      <column type="field" name="points" width="80" hidden="0"/>
      <column type="field" name="review" width="80" hidden="0"/>
      <column type="field" name="km" width="160" hidden="0"/>
      <column type="field" name="km_text" width="230" hidden="0"/>
    </columns>
  </attributetableconfig>
  <mapTip>&lt;b&gt;[% &quot;finding&quot; %]: [% &quot;reason&quot; %]&lt;/b&gt;&lt;br&gt;[% if(&quot;rail_id&quot; IS NULL, &#x27;Track &#x27; || &quot;track_id&quot;, &#x27;Rail &#x27; || &quot;rail_id&quot;) %], [% coalesce(format_number(&quot;from_m&quot;, 1) || &#x27; m&#x27;, &#x27;unknown&#x27;) %] to [% coalesce(format_number(&quot;to_m&quot;, 1) || &#x27; m&#x27;, &#x27;unknown&#x27;) %]&lt;br&gt;Review: [% if(coalesce(&quot;review&quot;, &#x27;&#x27;) = &#x27;&#x27;, &#x27;open&#x27;, &quot;review&quot;) %]</mapTip>
  <elevation zoffset="0" zscale="1" clamping="Absolute" binding="Vertex" type="IndividualFeatures" respectLayerSymbol="1"/>
  <layerGeometryType>1</layerGeometryType>
</qgis>
