<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis styleCategories="Symbology|Labeling|Elevation|Fields|MapTips|AttributeTable" version="3.22.0" labelsEnabled="1">
  <renderer-v2 type="categorizedSymbol" attr="type">
    <categories>
      <category value="line" symbol="0" label="straight" render="true"/>
      <category value="clothoid" symbol="1" label="clothoid" render="true"/>
      <category value="arc" symbol="2" label="arc" render="true"/>
      <category value="grade" symbol="3" label="grade, along the same line" render="false"/>
      <category value="parabola" symbol="4" label="parabola, along the same line" render="false"/>
      <category value="constant" symbol="5" label="constant cant, along the same line" render="false"/>
      <category value="ramp" symbol="6" label="cant ramp, along the same line" render="false"/>
    </categories>
    <symbols>
      <symbol name="0" type="line" alpha="1">
        <layer class="SimpleLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="line_color" type="QString" value="84,110,122,255"/>
            <Option name="line_width" type="QString" value="0.9"/>
            <Option name="line_width_unit" type="QString" value="MM"/>
            <Option name="line_style" type="QString" value="solid"/>
            <Option name="capstyle" type="QString" value="flat"/>
            <Option name="joinstyle" type="QString" value="round"/>
          </Option>
        </layer>
        <layer class="MarkerLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="placement" type="QString" value="firstvertex"/>
            <Option name="rotate" type="QString" value="1"/>
          </Option>
          <symbol name="@0@1" type="marker" alpha="1">
            <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
              <Option type="Map">
                <Option name="name" type="QString" value="line"/>
                <Option name="outline_color" type="QString" value="29,39,51,255"/>
                <Option name="outline_width" type="QString" value="0.4"/>
                <Option name="size" type="QString" value="5"/>
                <Option name="size_unit" type="QString" value="MM"/>
              </Option>
            </layer>
          </symbol>
        </layer>
      </symbol>
      <symbol name="1" type="line" alpha="1">
        <layer class="SimpleLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="line_color" type="QString" value="242,142,43,255"/>
            <Option name="line_width" type="QString" value="0.9"/>
            <Option name="line_width_unit" type="QString" value="MM"/>
            <Option name="line_style" type="QString" value="solid"/>
            <Option name="capstyle" type="QString" value="flat"/>
            <Option name="joinstyle" type="QString" value="round"/>
          </Option>
        </layer>
        <layer class="MarkerLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="placement" type="QString" value="firstvertex"/>
            <Option name="rotate" type="QString" value="1"/>
          </Option>
          <symbol name="@1@1" type="marker" alpha="1">
            <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
              <Option type="Map">
                <Option name="name" type="QString" value="line"/>
                <Option name="outline_color" type="QString" value="29,39,51,255"/>
                <Option name="outline_width" type="QString" value="0.4"/>
                <Option name="size" type="QString" value="5"/>
                <Option name="size_unit" type="QString" value="MM"/>
              </Option>
            </layer>
          </symbol>
        </layer>
      </symbol>
      <symbol name="2" type="line" alpha="1">
        <layer class="SimpleLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="line_color" type="QString" value="21,101,192,255"/>
            <Option name="line_width" type="QString" value="0.9"/>
            <Option name="line_width_unit" type="QString" value="MM"/>
            <Option name="line_style" type="QString" value="solid"/>
            <Option name="capstyle" type="QString" value="flat"/>
            <Option name="joinstyle" type="QString" value="round"/>
          </Option>
        </layer>
        <layer class="MarkerLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="placement" type="QString" value="firstvertex"/>
            <Option name="rotate" type="QString" value="1"/>
          </Option>
          <symbol name="@2@1" type="marker" alpha="1">
            <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
              <Option type="Map">
                <Option name="name" type="QString" value="line"/>
                <Option name="outline_color" type="QString" value="29,39,51,255"/>
                <Option name="outline_width" type="QString" value="0.4"/>
                <Option name="size" type="QString" value="5"/>
                <Option name="size_unit" type="QString" value="MM"/>
              </Option>
            </layer>
          </symbol>
        </layer>
      </symbol>
      <symbol name="3" type="line" alpha="1">
        <layer class="SimpleLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="line_color" type="QString" value="142,91,181,255"/>
            <Option name="line_width" type="QString" value="0.5"/>
            <Option name="line_width_unit" type="QString" value="MM"/>
            <Option name="line_style" type="QString" value="solid"/>
            <Option name="capstyle" type="QString" value="flat"/>
            <Option name="joinstyle" type="QString" value="round"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="4" type="line" alpha="1">
        <layer class="SimpleLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="line_color" type="QString" value="142,91,181,255"/>
            <Option name="line_width" type="QString" value="0.5"/>
            <Option name="line_width_unit" type="QString" value="MM"/>
            <Option name="line_style" type="QString" value="solid"/>
            <Option name="capstyle" type="QString" value="flat"/>
            <Option name="joinstyle" type="QString" value="round"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="5" type="line" alpha="1">
        <layer class="SimpleLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="line_color" type="QString" value="46,125,79,255"/>
            <Option name="line_width" type="QString" value="0.5"/>
            <Option name="line_width_unit" type="QString" value="MM"/>
            <Option name="line_style" type="QString" value="solid"/>
            <Option name="capstyle" type="QString" value="flat"/>
            <Option name="joinstyle" type="QString" value="round"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="6" type="line" alpha="1">
        <layer class="SimpleLine" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="line_color" type="QString" value="46,125,79,255"/>
            <Option name="line_width" type="QString" value="0.5"/>
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
      <text-style fieldName="CASE WHEN &quot;type&quot; = &#x27;line&#x27; THEN format_number(&quot;length_m&quot;, 1) || &#x27; m&#x27; WHEN &quot;type&quot; = &#x27;arc&#x27; THEN &#x27;R &#x27; || format_number(&quot;r1_m&quot;, 0) || &#x27;, &#x27; || format_number(&quot;length_m&quot;, 1) || &#x27; m&#x27; WHEN &quot;type&quot; = &#x27;clothoid&#x27; THEN &#x27;A &#x27; || format_number(&quot;a_param&quot;, 0) || &#x27;, &#x27; || format_number(&quot;length_m&quot;, 1) || &#x27; m&#x27; END" isExpression="1" fontSize="8" fontSizeUnit="Point" textColor="29,39,51,255" textOpacity="1">
        <text-buffer bufferDraw="1" bufferSize="0.8" bufferSizeUnits="MM" bufferColor="255,255,255,255" bufferOpacity="1"/>
      </text-style>
      <placement placement="2" placementFlags="10" dist="1" distUnits="MM" priority="5"/>
      <rendering drawLabels="1" obstacle="1" fontMaxPixelSize="10000" maxNumLabels="2000"/>
    </settings>
  </labeling>
  <aliases>
    <alias field="track_id" index="0" name="Track"/>
    <alias field="no" index="1" name="Number"/>
    <alias field="layout" index="2" name="Layout (H, V, C)"/>
    <alias field="type" index="3" name="Type"/>
    <alias field="km_from" index="4" name="Kilometre of the start"/>
    <alias field="km_to" index="5" name="Kilometre of the end"/>
    <alias field="s_from" index="6" name="Start along the track [m]"/>
    <alias field="s_to" index="7" name="End along the track [m]"/>
    <alias field="length_m" index="8" name="Length [m]"/>
    <alias field="r1_m" index="9" name="Radius at the start [m]"/>
    <alias field="r2_m" index="10" name="Radius at the end [m]"/>
    <alias field="a_param" index="11" name="Parameter A [m]"/>
    <alias field="rot" index="12" name="Turns to (L, R)"/>
    <alias field="x" index="13" name="Easting of the start"/>
    <alias field="y" index="14" name="Northing of the start"/>
    <alias field="z" index="15" name="Height of the start"/>
    <alias field="azimuth_gon" index="16" name="Azimuth of the start [gon]"/>
    <alias field="heading" index="17" name="Direction of the start [rad]"/>
    <alias field="grade1_pm" index="18" name="Gradient at the start [‰]"/>
    <alias field="grade2_pm" index="19" name="Gradient at the end [‰]"/>
    <alias field="cant1_mm" index="20" name="Cant at the start [mm]"/>
    <alias field="cant2_mm" index="21" name="Cant at the end [mm]"/>
    <alias field="dev_rms_mm" index="22" name="Deviation, RMS [mm]"/>
    <alias field="dev_max_mm" index="23" name="Deviation, largest [mm]"/>
    <alias field="sigma_r_m" index="24" name="Standard error of the radius [m]"/>
    <alias field="sigma_len_m" index="25" name="Standard error of the length [m]"/>
    <alias field="sigma_s_m" index="26" name="Standard error of the start [m]"/>
    <alias field="joint" index="27" name="Begins with (G1, G2)"/>
    <alias field="r_round_m" index="28" name="Round radius proposed [m]"/>
    <alias field="dev_rms_round_mm" index="29" name="Deviation with round radii, RMS [mm]"/>
    <alias field="r_fit_m" index="30" name="Radius of an arc as fitted [m]"/>
    <alias field="s_fit_m" index="31" name="Start as fitted [m]"/>
  </aliases>
  <attributetableconfig>
    <columns>
      <column type="field" name="track_id" width="70" hidden="0"/>
      <column type="field" name="no" width="80" hidden="0"/>
      <column type="field" name="layout" width="160" hidden="0"/>
      <column type="field" name="type" width="60" hidden="0"/>
      <column type="field" name="km_from" width="220" hidden="0"/>
      <column type="field" name="km_to" width="200" hidden="0"/>
      <column type="field" name="s_from" width="240" hidden="0"/>
      <column type="field" name="s_to" width="220" hidden="0"/>
      <column type="field" name="length_m" width="110" hidden="0"/>
      <column type="field" name="r1_m" width="220" hidden="0"/>
      <column type="field" name="r2_m" width="210" hidden="0"/>
      <column type="field" name="a_param" width="160" hidden="0"/>
      <column type="field" name="rot" width="160" hidden="0"/>
      <column type="field" name="x" width="200" hidden="0"/>
      <column type="field" name="y" width="210" hidden="0"/>
      <column type="field" name="z" width="190" hidden="0"/>
      <column type="field" name="azimuth_gon" width="250" hidden="0"/>
      <column type="field" name="heading" width="270" hidden="0"/>
      <column type="field" name="grade1_pm" width="240" hidden="0"/>
      <column type="field" name="grade2_pm" width="220" hidden="0"/>
      <column type="field" name="cant1_mm" width="220" hidden="0"/>
      <column type="field" name="cant2_mm" width="200" hidden="0"/>
      <column type="field" name="dev_rms_mm" width="190" hidden="0"/>
      <column type="field" name="dev_max_mm" width="220" hidden="0"/>
      <column type="field" name="sigma_r_m" width="300" hidden="0"/>
      <column type="field" name="sigma_len_m" width="300" hidden="0"/>
      <column type="field" name="sigma_s_m" width="290" hidden="0"/>
      <column type="field" name="joint" width="200" hidden="0"/>
      <column type="field" name="r_round_m" width="240" hidden="0"/>
      <column type="field" name="dev_rms_round_mm" width="330" hidden="0"/>
      <column type="field" name="r_fit_m" width="280" hidden="0"/>
      <column type="field" name="s_fit_m" width="190" hidden="0"/>
    </columns>
  </attributetableconfig>
  <mapTip>&lt;b&gt;Track [% &quot;track_id&quot; %], [% &quot;type&quot; %] [% &quot;no&quot; %]&lt;/b&gt;&lt;br&gt;Length: [% format_number(&quot;length_m&quot;, 2) || &#x27; m&#x27; %]&lt;br&gt;[% CASE WHEN &quot;layout&quot; = &#x27;H&#x27; THEN &#x27;Radius: &#x27; || coalesce(format_number(&quot;r1_m&quot;, 1), &#x27;straight&#x27;) || &#x27; to &#x27; || coalesce(format_number(&quot;r2_m&quot;, 1), &#x27;straight&#x27;) WHEN &quot;layout&quot; = &#x27;V&#x27; THEN &#x27;Gradient: &#x27; || format_number(&quot;grade1_pm&quot;, 2) || &#x27; to &#x27; || format_number(&quot;grade2_pm&quot;, 2) || &#x27; ‰&#x27; ELSE &#x27;Cant: &#x27; || format_number(&quot;cant1_mm&quot;, 0) || &#x27; to &#x27; || format_number(&quot;cant2_mm&quot;, 0) || &#x27; mm&#x27; END %]&lt;br&gt;Deviation, RMS: [% coalesce(format_number(&quot;dev_rms_mm&quot;, 1) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %]</mapTip>
  <elevation zoffset="0" zscale="1" clamping="Absolute" binding="Vertex" type="IndividualFeatures" respectLayerSymbol="1"/>
  <layerGeometryType>1</layerGeometryType>
</qgis>
