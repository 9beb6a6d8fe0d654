<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis styleCategories="Symbology|Elevation|Fields|MapTips|AttributeTable" version="3.22.0">
  <renderer-v2 type="singleSymbol">
    <symbols>
      <symbol name="0" type="line" alpha="1">
        <layer class="SimpleLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="line_color" type="QString" value="109,76,65,255"/>
            <Option name="line_width" type="QString" value="0.6"/>
            <Option name="line_width_unit" type="QString" value="MM"/>
            <Option name="line_style" type="QString" value="solid"/>
            <Option name="capstyle" type="QString" value="flat"/>
            <Option name="joinstyle" type="QString" value="round"/>
          </Option>
        </layer>
      </symbol>
    </symbols>
  </renderer-v2>
  <aliases>
    <alias field="wire" index="0" name="Wire"/>
    <alias field="track_id" index="1" name="Track"/>
    <alias field="from_m" index="2" name="From [m]"/>
    <alias field="to_m" index="3" name="To [m]"/>
    <alias field="length_m" index="4" name="Length [m]"/>
    <alias field="height_mm" index="5" name="Height, mean [mm]"/>
    <alias field="hmin_mm" index="6" name="Least height [mm]"/>
    <alias field="hmax_mm" index="7" name="Largest height [mm]"/>
    <alias field="stagmin_mm" index="8" name="Least stagger [mm]"/>
    <alias field="stagmax_mm" index="9" name="Largest stagger [mm]"/>
    <alias field="grade_pm" index="10" name="Steepest gradient [‰]"/>
    <alias field="sigma_mm" index="11" name="Standard error [mm]"/>
    <alias field="km_from" index="12" name="From kilometre"/>
    <alias field="km_to" index="13" name="To kilometre"/>
  </aliases>
  <attributetableconfig>
    <columns>
      <column type="field" name="wire" width="60" hidden="0"/>
      <column type="field" name="track_id" width="60" hidden="0"/>
      <column type="field" name="from_m" width="90" hidden="0"/>
      <column type="field" name="to_m" width="70" hidden="0"/>
      <column type="field" name="length_m" width="110" hidden="0"/>
      <column type="field" name="height_mm" width="180" hidden="0"/>
      <column type="field" name="hmin_mm" width="180" hidden="0"/>
      <column type="field" name="hmax_mm" width="200" hidden="0"/>
      <column type="field" name="stagmin_mm" width="190" hidden="0"/>
      <column type="field" name="stagmax_mm" width="210" hidden="0"/>
      <column type="field" name="grade_pm" width="220" hidden="0"/>
      <column type="field" name="sigma_mm" width="200" hidden="0"/>
      <column type="field" name="km_from" width="150" hidden="0"/>
      <column type="field" name="km_to" width="130" hidden="0"/>
    </columns>
  </attributetableconfig>
  <mapTip>&lt;b&gt;Wire [% &quot;wire&quot; %]&lt;/b&gt;&lt;br&gt;Height: [% coalesce(format_number(&quot;height_mm&quot;, 1) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %]&lt;br&gt;Stagger: [% coalesce(format_number(&quot;stagmin_mm&quot;, 0) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %] to [% coalesce(format_number(&quot;stagmax_mm&quot;, 0) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %]</mapTip>
  <elevation zoffset="0" zscale="1" clamping="Absolute" binding="Vertex" type="IndividualFeatures" respectLayerSymbol="1"/>
  <layerGeometryType>1</layerGeometryType>
</qgis>
