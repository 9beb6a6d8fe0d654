<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis version="3.22" styleCategories="Fields">
  <aliases>
    <alias field="axis" name="Axis"/>
    <alias field="piece" name="Section between jumps"/>
    <alias field="km" name="Kilometre"/>
    <alias field="km_text" name="Kilometre as text"/>
    <alias field="offset_m" name="Offset from the axis [m]"/>
    <alias field="side" name="Side of the axis"/>
    <alias field="ambiguous" name="Kilometre ambiguous"/>
    <alias field="km_from" name="Kilometre from"/>
    <alias field="km_to" name="Kilometre to"/>
  </aliases>
</qgis>
