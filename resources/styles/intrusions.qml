<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis styleCategories="Symbology|Labeling|Elevation|Fields|MapTips|Forms|AttributeTable" version="3.22.0" labelsEnabled="1">
  <renderer-v2 type="graduatedSymbol" attr="case when &quot;what&quot; &lt;&gt; &#x27;&#x27; then -2 when &quot;sure&quot; = 0 then -1 else &quot;pen_mm&quot; end" graduatedMethod="GraduatedColor">
    <ranges>
      <range lower="-2.5" upper="-1.5" symbol="0" label="allowed: vehicle, platform, contact wire" render="true"/>
      <range lower="-1.5" upper="-0.5" symbol="1" label="in doubt" render="true"/>
      <range lower="-0.5" upper="10" symbol="2" label="up to 10 mm inside" render="true"/>
      <range lower="10" upper="50" symbol="3" label="10 to 50 mm inside" render="true"/>
      <range lower="50" upper="150" symbol="4" label="50 to 150 mm inside" render="true"/>
      <range lower="150" upper="100000" symbol="5" label="more than 150 mm inside" render="true"/>
    </ranges>
    <symbols>
      <symbol name="0" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="154,165,177,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="2.2"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="1" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="255,255,255,0"/>
            <Option name="outline_color" type="QString" value="203,24,29,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
            <Option name="outline_width" type="QString" value="0.6"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="3"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="2" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="252,187,161,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="2.6"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="3" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="251,106,74,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="3.0"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="4" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="203,24,29,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="3.4000000000000004"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="5" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="103,0,13,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="3.8000000000000003"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
        </layer>
      </symbol>
    </symbols>
  </renderer-v2>
  <labeling type="simple">
    <settings calloutType="simple">
      <text-style fieldName="round(&quot;pen_mm&quot;) || &#x27; mm&#x27;" isExpression="1" fontSize="8" fontSizeUnit="Point" textColor="60,60,60,255" textOpacity="1">
        <text-buffer bufferDraw="1" bufferSize="0.9" bufferSizeUnits="MM" bufferColor="255,255,255,255" bufferOpacity="1"/>
      </text-style>
      <placement placement="0" dist="2" distUnits="MM" priority="7"/>
      <rendering drawLabels="1" obstacle="1" fontMaxPixelSize="10000" maxNumLabels="2000"/>
    </settings>
  </labeling>
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
    <alias field="intrusion" index="0" name="Intrusion"/>
    <alias field="track_id" index="1" name="Track"/>
    <alias field="from_m" index="2" name="From [m]"/>
    <alias field="to_m" index="3" name="To [m]"/>
    <alias field="chainage_m" index="4" name="Chainage [m]"/>
    <alias field="side" index="5" name="Side"/>
    <alias field="v_mm" index="6" name="To the left [mm]"/>
    <alias field="w_mm" index="7" name="Height [mm]"/>
    <alias field="wmin_mm" index="8" name="Lowest point [mm]"/>
    <alias field="wmax_mm" index="9" name="Highest point [mm]"/>
    <alias field="pen_mm" index="10" name="Inside [mm]"/>
    <alias field="raw_mm" index="11" name="Deepest point inside [mm]"/>
    <alias field="sigma_mm" index="12" name="Standard error [mm]"/>
    <alias field="sure" index="13" name="Sure"/>
    <alias field="points" index="14" name="Points"/>
    <alias field="class_code" index="15" name="Class"/>
    <alias field="what" index="16" name="What"/>
    <alias field="km" index="17" name="Kilometre"/>
    <alias field="km_text" index="18" name="Kilometre as text"/>
    <alias field="review" index="19" name="Review"/>
  </aliases>
  <attributetableconfig>
    <columns>
      <column type="field" name="intrusion" width="100" hidden="0"/>
      <column type="field" name="track_id" width="60" hidden="0"/>
      <column type="field" name="from_m" width="90" hidden="0"/>
      <column type="field" name="to_m" width="70" hidden="0"/>
      <column type="field" name="chainage_m" width="130" hidden="0"/>
      <column type="field" name="side" width="60" hidden="0"/>
      <column type="field" name="v_mm" width="170" hidden="0"/>
      <column type="field" name="w_mm" width="120" hidden="0"/>
      <column type="field" name="wmin_mm" width="180" hidden="0"/>
      <column type="field" name="wmax_mm" width="190" hidden="0"/>
      <column type="field" name="pen_mm" width="120" hidden="0"/>
      <column type="field" name="raw_mm" width="260" hidden="0"/>
      <column type="field" name="sigma_mm" width="200" hidden="0"/>
      <column type="field" name="sure" width="60" hidden="0"/>
      <column type="field" name="points" width="70" hidden="0"/>
      <column type="field" name="class_code" width="60" hidden="0"/>
      <column type="field" name="what" width="60" hidden="0"/>
      <column type="field" name="km" width="100" hidden="0"/>
      <column type="field" name="km_text" width="180" hidden="0"/>
      <column type="field" name="review" width="70" hidden="0"/>
    </columns>
  </attributetableconfig>
  <mapTip>&lt;b&gt;[% &quot;intrusion&quot; %]: [% coalesce(format_number(&quot;pen_mm&quot;, 1) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %] inside&lt;/b&gt;&lt;br&gt;Standard error: [% coalesce(format_number(&quot;sigma_mm&quot;, 1) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %]&lt;br&gt;Track [% &quot;track_id&quot; %], [% format_number(&quot;chainage_m&quot;, 1) %] m, [% &quot;side&quot; %]&lt;br&gt;[% coalesce(&quot;what&quot;, &#x27;&#x27;) %]&lt;br&gt;Review: [% if(coalesce(&quot;review&quot;, &#x27;&#x27;) = &#x27;&#x27;, &#x27;open&#x27;, &quot;review&quot;) %]</mapTip>
  <elevation zoffset="0" zscale="1" clamping="Absolute" binding="Vertex" type="IndividualFeatures" respectLayerSymbol="1"/>
  <layerGeometryType>0</layerGeometryType>
</qgis>
