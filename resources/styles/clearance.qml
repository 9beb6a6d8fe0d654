<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis styleCategories="Symbology|Elevation|Fields|MapTips|AttributeTable" version="3.22.0">
  <renderer-v2 type="graduatedSymbol" attr="coalesce(min(&quot;lmar_mm&quot;, &quot;rmar_mm&quot;), 999999)" graduatedMethod="GraduatedColor">
    <ranges>
      <range lower="-100000" upper="0" symbol="0" label="inside" render="true"/>
      <range lower="0" upper="50" symbol="1" label="less than 50 mm free" render="true"/>
      <range lower="50" upper="150" symbol="2" label="50 to 150 mm free" render="true"/>
      <range lower="150" upper="400" symbol="3" label="150 to 400 mm free" render="true"/>
      <range lower="400" upper="100000" symbol="4" label="more than 400 mm free" render="true"/>
      <range lower="100000" upper="1000000" symbol="5" label="nothing beside" render="true"/>
    </ranges>
    <symbols>
      <symbol name="0" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="214,40,57,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
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
            <Option name="color" type="QString" value="242,142,43,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
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
            <Option name="color" type="QString" value="233,214,107,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
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
            <Option name="color" type="QString" value="159,208,168,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
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
            <Option name="color" type="QString" value="77,160,90,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="2"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="5" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="190,190,190,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="2"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
        </layer>
      </symbol>
    </symbols>
  </renderer-v2>
  <aliases>
    <alias field="track_id" index="0" name="Track"/>
    <alias field="chainage_m" index="1" name="Chainage [m]"/>
    <alias field="cant_mm" index="2" name="Cant [mm]"/>
    <alias field="radius_m" index="3" name="Radius [m]"/>
    <alias field="wide_l_mm" index="4" name="Widening on the left [mm]"/>
    <alias field="wide_r_mm" index="5" name="Widening on the right [mm]"/>
    <alias field="lmar_mm" index="6" name="Least margin on the left [mm]"/>
    <alias field="rmar_mm" index="7" name="Least margin on the right [mm]"/>
    <alias field="l1_mm" index="8" name="Left, height up to 380: distance [mm]"/>
    <alias field="l2_mm" index="9" name="Left, height 380 to 1170: distance [mm]"/>
    <alias field="l3_mm" index="10" name="Left, height 1170 to 3250: distance [mm]"/>
    <alias field="l4_mm" index="11" name="Left, height 3250 to 4310: distance [mm]"/>
    <alias field="l5_mm" index="12" name="Left, height 4310 to 7000: distance [mm]"/>
    <alias field="r1_mm" index="13" name="Right, height up to 380: distance [mm]"/>
    <alias field="r2_mm" index="14" name="Right, height 380 to 1170: distance [mm]"/>
    <alias field="r3_mm" index="15" name="Right, height 1170 to 3250: distance [mm]"/>
    <alias field="r4_mm" index="16" name="Right, height 3250 to 4310: distance [mm]"/>
    <alias field="r5_mm" index="17" name="Right, height 4310 to 7000: distance [mm]"/>
    <alias field="l1m_mm" index="18" name="Left, height up to 380: margin [mm]"/>
    <alias field="l2m_mm" index="19" name="Left, height 380 to 1170: margin [mm]"/>
    <alias field="l3m_mm" index="20" name="Left, height 1170 to 3250: margin [mm]"/>
    <alias field="l4m_mm" index="21" name="Left, height 3250 to 4310: margin [mm]"/>
    <alias field="l5m_mm" index="22" name="Left, height 4310 to 7000: margin [mm]"/>
    <alias field="r1m_mm" index="23" name="Right, height up to 380: margin [mm]"/>
    <alias field="r2m_mm" index="24" name="Right, height 380 to 1170: margin [mm]"/>
    <alias field="r3m_mm" index="25" name="Right, height 1170 to 3250: margin [mm]"/>
    <alias field="r4m_mm" index="26" name="Right, height 3250 to 4310: margin [mm]"/>
    <alias field="r5m_mm" index="27" name="Right, height 4310 to 7000: margin [mm]"/>
    <alias field="ldist_m" index="28" name="Distance of the track on the left [m]"/>
    <alias field="ltrack" index="29" name="Track on the left"/>
    <alias field="ldz_mm" index="30" name="Track on the left, higher by [mm]"/>
    <alias field="rdist_m" index="31" name="Distance of the track on the right [m]"/>
    <alias field="rtrack" index="32" name="Track on the right"/>
    <alias field="rdz_mm" index="33" name="Track on the right, higher by [mm]"/>
    <alias field="loff_mm" index="34" name="Platform on the left, offset [mm]"/>
    <alias field="lhgt_mm" index="35" name="Platform on the left, height [mm]"/>
    <alias field="roff_mm" index="36" name="Platform on the right, offset [mm]"/>
    <alias field="rhgt_mm" index="37" name="Platform on the right, height [mm]"/>
    <alias field="wire_mm" index="38" name="Contact wire, height [mm]"/>
    <alias field="stagger_mm" index="39" name="Contact wire, stagger [mm]"/>
    <alias field="points" index="40" name="Points"/>
    <alias field="bridged" index="41" name="Rail without points"/>
    <alias field="km" index="42" name="Kilometre"/>
    <alias field="km_text" index="43" name="Kilometre as text"/>
  </aliases>
  <attributetableconfig>
    <columns>
      <column type="field" name="track_id" width="60" hidden="0"/>
      <column type="field" name="chainage_m" width="130" hidden="0"/>
      <column type="field" name="cant_mm" width="100" hidden="0"/>
      <column type="field" name="radius_m" width="110" hidden="0"/>
      <column type="field" name="wide_l_mm" width="260" hidden="0"/>
      <column type="field" name="wide_r_mm" width="270" hidden="0"/>
      <column type="field" name="lmar_mm" width="300" hidden="0"/>
      <column type="field" name="rmar_mm" width="310" hidden="0"/>
      <column type="field" name="l1_mm" width="380" hidden="0"/>
      <column type="field" name="l2_mm" width="400" hidden="0"/>
      <column type="field" name="l3_mm" width="410" hidden="0"/>
      <column type="field" name="l4_mm" width="410" hidden="0"/>
      <column type="field" name="l5_mm" width="410" hidden="0"/>
      <column type="field" name="r1_mm" width="390" hidden="0"/>
      <column type="field" name="r2_mm" width="410" hidden="0"/>
      <column type="field" name="r3_mm" width="420" hidden="0"/>
      <column type="field" name="r4_mm" width="420" hidden="0"/>
      <column type="field" name="r5_mm" width="420" hidden="0"/>
      <column type="field" name="l1m_mm" width="360" hidden="0"/>
      <column type="field" name="l2m_mm" width="380" hidden="0"/>
      <column type="field" name="l3m_mm" width="390" hidden="0"/>
      <column type="field" name="l4m_mm" width="390" hidden="0"/>
      <column type="field" name="l5m_mm" width="390" hidden="0"/>
      <column type="field" name="r1m_mm" width="370" hidden="0"/>
      <column type="field" name="r2m_mm" width="390" hidden="0"/>
      <column type="field" name="r3m_mm" width="400" hidden="0"/>
      <column type="field" name="r4m_mm" width="400" hidden="0"/>
      <column type="field" name="r5m_mm" width="400" hidden="0"/>
      <column type="field" name="ldist_m" width="380" hidden="0"/>
      <column type="field" name="ltrack" width="180" hidden="0"/>
      <column type="field" name="ldz_mm" width="340" hidden="0"/>
      <column type="field" name="rdist_m" width="390" hidden="0"/>
      <column type="field" name="rtrack" width="190" hidden="0"/>
      <column type="field" name="rdz_mm" width="350" hidden="0"/>
      <column type="field" name="loff_mm" width="340" hidden="0"/>
      <column type="field" name="lhgt_mm" width="340" hidden="0"/>
      <column type="field" name="roff_mm" width="350" hidden="0"/>
      <column type="field" name="rhgt_mm" width="350" hidden="0"/>
      <column type="field" name="wire_mm" width="260" hidden="0"/>
      <column type="field" name="stagger_mm" width="270" hidden="0"/>
      <column type="field" name="points" width="70" hidden="0"/>
      <column type="field" name="bridged" width="200" hidden="0"/>
      <column type="field" name="km" width="100" hidden="0"/>
      <column type="field" name="km_text" width="180" hidden="0"/>
    </columns>
  </attributetableconfig>
  <mapTip>&lt;b&gt;Track [% &quot;track_id&quot; %], [% format_number(&quot;chainage_m&quot;, 1) %] m&lt;/b&gt;&lt;br&gt;Margin left: [% coalesce(format_number(&quot;lmar_mm&quot;, 0) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %]&lt;br&gt;Margin right: [% coalesce(format_number(&quot;rmar_mm&quot;, 0) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %]</mapTip>
  <elevation zoffset="0" zscale="1" clamping="Absolute" binding="Vertex" type="IndividualFeatures" respectLayerSymbol="1"/>
  <layerGeometryType>0</layerGeometryType>
</qgis>
