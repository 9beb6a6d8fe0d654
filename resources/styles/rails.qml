<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis styleCategories="Symbology|Symbology3D|Elevation|Fields|MapTips|AttributeTable" version="3.22.0">
  <renderer-v2 type="graduatedSymbol" attr="CASE WHEN coalesce(&quot;track_ids&quot;, '') = '' AND coalesce(maximum(length(&quot;track_ids&quot;)), 0) &gt; 0 THEN -1 ELSE coalesce(&quot;sigma_mm&quot;, 999999) END" graduatedMethod="GraduatedColor">
    <ranges>
      <range lower="0" upper="2" symbol="0" label="standard error up to 2 mm" render="true"/>
      <range lower="2" upper="5" symbol="1" label="2 to 5 mm" render="true"/>
      <range lower="5" upper="10" symbol="2" label="5 to 10 mm" render="true"/>
      <range lower="10" upper="1000000" symbol="3" label="above 10 mm, or unknown" render="true"/>
      <range lower="-1" upper="-0.5" symbol="4" label="lone rail: belongs to no track" render="true"/>
    </ranges>
    <symbols>
      <symbol name="0" type="line" alpha="1">
        <layer class="SimpleLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="line_color" type="QString" value="21,101,192,255"/>
            <Option name="line_width" type="QString" value="0.6"/>
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
            <Option name="line_color" type="QString" value="79,179,191,255"/>
            <Option name="line_width" type="QString" value="0.6"/>
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
            <Option name="line_color" type="QString" value="242,142,43,255"/>
            <Option name="line_width" type="QString" value="0.6"/>
            <Option name="line_width_unit" type="QString" value="MM"/>
            <Option name="line_style" type="QString" value="solid"/>
            <Option name="capstyle" type="QString" value="round"/>
            <Option name="joinstyle" type="QString" value="round"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="3" type="line" alpha="1">
        <layer class="SimpleLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="line_color" type="QString" value="214,40,57,255"/>
            <Option name="line_width" type="QString" value="0.6"/>
            <Option name="line_width_unit" type="QString" value="MM"/>
            <Option name="line_style" type="QString" value="solid"/>
            <Option name="capstyle" type="QString" value="round"/>
            <Option name="joinstyle" type="QString" value="round"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="4" type="line" alpha="1">
        <layer class="SimpleLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="line_color" type="QString" value="130,90,160,255"/>
            <Option name="line_width" type="QString" value="0.6"/>
            <Option name="line_width_unit" type="QString" value="MM"/>
            <Option name="line_style" type="QString" value="dash"/>
            <Option name="capstyle" type="QString" value="round"/>
            <Option name="joinstyle" type="QString" value="round"/>
          </Option>
        </layer>
      </symbol>
    </symbols>
    <classificationMethod id="Custom"/>
  </renderer-v2>
  <renderer-3d type="vector" layer="">
    <symbol type="line" material_type="simpleline">
      <data alt-clamping="absolute" alt-binding="vertex" height="0" extrusion-height="0" simple-lines="1" width="3"/>
      <material ambient="21,101,192,255"/>
    </symbol>
  </renderer-3d>
  <aliases>
    <alias field="rail_id" index="0" name="Rail"/>
    <alias field="class_code" index="1" name="Class"/>
    <alias field="length_m" index="2" name="Length [m]"/>
    <alias field="points" index="3" name="Points"/>
    <alias field="resid_mm" index="4" name="Scatter of the points [mm]"/>
    <alias field="sigma_mm" index="5" name="Standard error [mm]"/>
    <alias field="bridged_m" index="6" name="Without points [m]"/>
    <alias field="track_ids" index="7" name="Tracks"/>
    <alias field="gaps" index="8" name="Sections without points"/>
    <alias field="sigmaz_mm" index="9" name="Standard error of the height [mm]"/>
  </aliases>
  <attributetableconfig>
    <columns>
      <column type="field" name="rail_id" width="60" hidden="0"/>
      <column type="field" name="class_code" width="70" hidden="0"/>
      <column type="field" name="length_m" width="110" hidden="0"/>
      <column type="field" name="points" width="80" hidden="0"/>
      <column type="field" name="resid_mm" width="250" hidden="0"/>
      <column type="field" name="sigma_mm" width="190" hidden="0"/>
      <column type="field" name="bridged_m" width="180" hidden="0"/>
      <column type="field" name="track_ids" width="80" hidden="0"/>
      <column type="field" name="gaps" width="220" hidden="0"/>
      <column type="field" name="sigmaz_mm" width="310" hidden="0"/>
    </columns>
  </attributetableconfig>
  <mapTip>&lt;b&gt;Rail [% &quot;rail_id&quot; %]&lt;/b&gt;&lt;br&gt;Standard error: [% coalesce(format_number(&quot;sigma_mm&quot;, 1) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %]&lt;br&gt;Length: [% coalesce(format_number(&quot;length_m&quot;, 1) || &#x27; m&#x27;, &#x27;unknown&#x27;) %]&lt;br&gt;Without points: [% coalesce(format_number(&quot;bridged_m&quot;, 1) || &#x27; m&#x27;, &#x27;unknown&#x27;) %]&lt;br&gt;[% if(coalesce(&quot;track_ids&quot;, &#x27;&#x27;) = &#x27;&#x27;, &#x27;In no track&#x27;, &#x27;Track &#x27; || &quot;track_ids&quot;) %]</mapTip>
  <elevation zoffset="0" zscale="1" clamping="Absolute" binding="Vertex" type="IndividualFeatures" respectLayerSymbol="1"/>
  <layerGeometryType>1</layerGeometryType>
</qgis>
