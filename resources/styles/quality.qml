<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis styleCategories="Symbology|Elevation|Fields|MapTips|AttributeTable" version="3.22.0">
  <renderer-v2 type="graduatedSymbol" attr="coalesce(&quot;gauge_mm&quot; - median(&quot;gauge_mm&quot;, group_by:=&quot;track_id&quot;), 999999)" graduatedMethod="GraduatedColor">
    <ranges>
      <range lower="-10000" upper="-10" symbol="0" label="more than 10 mm narrow" render="true"/>
      <range lower="-10" upper="-5" symbol="1" label="5 to 10 mm narrow" render="true"/>
      <range lower="-5" upper="5" symbol="2" label="gauge within 5 mm of the track's median" render="true"/>
      <range lower="5" upper="10" symbol="3" label="5 to 10 mm wide" render="true"/>
      <range lower="10" upper="10000" symbol="4" label="more than 10 mm wide" render="true"/>
      <range lower="10000" upper="1000000" symbol="5" label="unknown" render="true"/>
      <range lower="1000001" upper="1000002" symbol="6" label="orange ring: a rail has no points" render="true"/>
    </ranges>
    <symbols>
      <symbol name="0" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="33,102,172,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="2"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
          <data_defined_properties>
            <Option type="Map">
              <Option name="name" type="QString" value=""/>
              <Option name="properties" type="Map">
                <Option name="outlineColor" type="Map">
                  <Option name="active" type="bool" value="true"/>
                  <Option name="expression" type="QString" value="if(&quot;bridged&quot; = 1, '#f28e2b', '#ffffff')"/>
                  <Option name="type" type="int" value="3"/>
                </Option>
                <Option name="outlineWidth" type="Map">
                  <Option name="active" type="bool" value="true"/>
                  <Option name="expression" type="QString" value="if(&quot;bridged&quot; = 1, 0.7, 0.2)"/>
                  <Option name="type" type="int" value="3"/>
                </Option>
              </Option>
              <Option name="type" type="QString" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol name="1" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="103,169,207,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="2"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
          <data_defined_properties>
            <Option type="Map">
              <Option name="name" type="QString" value=""/>
              <Option name="properties" type="Map">
                <Option name="outlineColor" type="Map">
                  <Option name="active" type="bool" value="true"/>
                  <Option name="expression" type="QString" value="if(&quot;bridged&quot; = 1, '#f28e2b', '#ffffff')"/>
                  <Option name="type" type="int" value="3"/>
                </Option>
                <Option name="outlineWidth" type="Map">
                  <Option name="active" type="bool" value="true"/>
                  <Option name="expression" type="QString" value="if(&quot;bridged&quot; = 1, 0.7, 0.2)"/>
                  <Option name="type" type="int" value="3"/>
                </Option>
              </Option>
              <Option name="type" type="QString" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol name="2" type="marker" alpha="1">
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
          <data_defined_properties>
            <Option type="Map">
              <Option name="name" type="QString" value=""/>
              <Option name="properties" type="Map">
                <Option name="outlineColor" type="Map">
                  <Option name="active" type="bool" value="true"/>
                  <Option name="expression" type="QString" value="if(&quot;bridged&quot; = 1, '#f28e2b', '#ffffff')"/>
                  <Option name="type" type="int" value="3"/>
                </Option>
                <Option name="outlineWidth" type="Map">
                  <Option name="active" type="bool" value="true"/>
                  <Option name="expression" type="QString" value="if(&quot;bridged&quot; = 1, 0.7, 0.2)"/>
                  <Option name="type" type="int" value="3"/>
                </Option>
              </Option>
              <Option name="type" type="QString" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol name="3" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="239,138,98,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="2"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
          <data_defined_properties>
            <Option type="Map">
              <Option name="name" type="QString" value=""/>
              <Option name="properties" type="Map">
                <Option name="outlineColor" type="Map">
                  <Option name="active" type="bool" value="true"/>
                  <Option name="expression" type="QString" value="if(&quot;bridged&quot; = 1, '#f28e2b', '#ffffff')"/>
                  <Option name="type" type="int" value="3"/>
                </Option>
                <Option name="outlineWidth" type="Map">
                  <Option name="active" type="bool" value="true"/>
                  <Option name="expression" type="QString" value="if(&quot;bridged&quot; = 1, 0.7, 0.2)"/>
                  <Option name="type" type="int" value="3"/>
                </Option>
              </Option>
              <Option name="type" type="QString" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol name="4" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="178,24,43,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="2"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
          <data_defined_properties>
            <Option type="Map">
              <Option name="name" type="QString" value=""/>
              <Option name="properties" type="Map">
                <Option name="outlineColor" type="Map">
                  <Option name="active" type="bool" value="true"/>
                  <Option name="expression" type="QString" value="if(&quot;bridged&quot; = 1, '#f28e2b', '#ffffff')"/>
                  <Option name="type" type="int" value="3"/>
                </Option>
                <Option name="outlineWidth" type="Map">
                  <Option name="active" type="bool" value="true"/>
                  <Option name="expression" type="QString" value="if(&quot;bridged&quot; = 1, 0.7, 0.2)"/>
                  <Option name="type" type="int" value="3"/>
                </Option>
              </Option>
              <Option name="type" type="QString" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol name="5" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="150,150,150,255"/>
            <Option name="outline_color" type="QString" value="255,255,255,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
            <Option name="outline_width" type="QString" value="0.2"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="2"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
          <data_defined_properties>
            <Option type="Map">
              <Option name="name" type="QString" value=""/>
              <Option name="properties" type="Map">
                <Option name="outlineColor" type="Map">
                  <Option name="active" type="bool" value="true"/>
                  <Option name="expression" type="QString" value="if(&quot;bridged&quot; = 1, '#f28e2b', '#ffffff')"/>
                  <Option name="type" type="int" value="3"/>
                </Option>
                <Option name="outlineWidth" type="Map">
                  <Option name="active" type="bool" value="true"/>
                  <Option name="expression" type="QString" value="if(&quot;bridged&quot; = 1, 0.7, 0.2)"/>
                  <Option name="type" type="int" value="3"/>
                </Option>
              </Option>
              <Option name="type" type="QString" value="collection"/>
            </Option>
          </data_defined_properties>
        </layer>
      </symbol>
      <symbol name="6" type="marker" alpha="1">
        <layer class="SimpleMarker" enabled="1" pass="0" locked="0">
          <Option type="Map">
            <Option name="name" type="QString" value="circle"/>
            <Option name="color" type="QString" value="255,255,255,255"/>
            <Option name="outline_color" type="QString" value="242,142,43,255"/>
            <Option name="outline_style" type="QString" value="solid"/>
            <Option name="outline_width" type="QString" value="0.7"/>
            <Option name="outline_width_unit" type="QString" value="MM"/>
            <Option name="size" type="QString" value="2"/>
            <Option name="size_unit" type="QString" value="MM"/>
          </Option>
        </layer>
      </symbol>
    </symbols>
    <classificationMethod id="Custom"/>
  </renderer-v2>
  <aliases>
    <alias field="track_id" index="0" name="Track"/>
    <alias field="chainage_m" index="1" name="Chainage [m]"/>
    <alias field="gauge_mm" index="2" name="Gauge [mm]"/>
    <alias field="cant_mm" index="3" name="Cant [mm]"/>
    <alias field="twist_mm" index="4" name="Twist over 3 m [mm]"/>
    <alias field="radius_m" index="5" name="Radius [m]"/>
    <alias field="grade_pm" index="6" name="Gradient [‰]"/>
    <alias field="sigma_mm" index="7" name="Standard error [mm]"/>
    <alias field="points" index="8" name="Points"/>
    <alias field="bridged" index="9" name="Rail without points"/>
    <alias field="strips" index="10" name="Strips"/>
    <alias field="strip_mm" index="11" name="Distance of the strips [mm]"/>
    <alias field="sigmaz_mm" index="12" name="Standard error of the height [mm]"/>
    <alias field="axis" index="13" name="Axis"/>
    <alias field="piece" index="14" name="Section between jumps"/>
    <alias field="km" index="15" name="Kilometre"/>
    <alias field="km_text" index="16" name="Kilometre as text"/>
    <alias field="offset_m" index="17" name="Offset from the axis [m]"/>
    <alias field="side" index="18" name="Side of the axis"/>
    <alias field="ambiguous" index="19" name="Kilometre ambiguous"/>
  </aliases>
  <attributetableconfig>
    <columns>
      <column type="field" name="track_id" width="70" hidden="0"/>
      <column type="field" name="chainage_m" width="130" hidden="0"/>
      <column type="field" name="gauge_mm" width="110" hidden="0"/>
      <column type="field" name="cant_mm" width="110" hidden="0"/>
      <column type="field" name="twist_mm" width="190" hidden="0"/>
      <column type="field" name="radius_m" width="110" hidden="0"/>
      <column type="field" name="grade_pm" width="130" hidden="0"/>
      <column type="field" name="sigma_mm" width="190" hidden="0"/>
      <column type="field" name="points" width="80" hidden="0"/>
      <column type="field" name="bridged" width="190" hidden="0"/>
      <column type="field" name="strips" width="80" hidden="0"/>
      <column type="field" name="strip_mm" width="260" hidden="0"/>
      <column type="field" name="sigmaz_mm" width="310" hidden="0"/>
      <column type="field" name="axis" width="60" hidden="0"/>
      <column type="field" name="piece" width="210" hidden="0"/>
      <column type="field" name="km" width="110" hidden="0"/>
      <column type="field" name="km_text" width="170" hidden="0"/>
      <column type="field" name="offset_m" width="230" hidden="0"/>
      <column type="field" name="side" width="160" hidden="0"/>
      <column type="field" name="ambiguous" width="190" hidden="0"/>
    </columns>
  </attributetableconfig>
  <mapTip>&lt;b&gt;Track [% &quot;track_id&quot; %], [% coalesce(format_number(&quot;chainage_m&quot;, 1) || &#x27; m&#x27;, &#x27;unknown&#x27;) %]&lt;/b&gt;&lt;br&gt;Gauge: [% coalesce(format_number(&quot;gauge_mm&quot;, 1) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %]&lt;br&gt;Cant: [% coalesce(format_number(&quot;cant_mm&quot;, 1) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %]&lt;br&gt;Twist: [% coalesce(format_number(&quot;twist_mm&quot;, 1) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %]&lt;br&gt;Standard error: [% coalesce(format_number(&quot;sigma_mm&quot;, 1) || &#x27; mm&#x27;, &#x27;unknown&#x27;) %]</mapTip>
  <elevation zoffset="0" zscale="1" clamping="Absolute" binding="Vertex" type="IndividualFeatures" respectLayerSymbol="1"/>
  <layerGeometryType>0</layerGeometryType>
</qgis>
