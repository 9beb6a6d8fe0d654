"""The core of Rail Extract: from classified lidar points to 3D rails and track centerlines, without QGIS and GDAL.

All computations run in float64 metres from a local origin (`frame.LocalFrame`).

Public, with names and meanings kept between versions:

- `front`: what `import rail_extract` gives, from files to tables, files and a report;
- `pipeline.extract_rails` and `parameters.Parameters`: the extraction and its settings;
- `clouds.points.read_rail_points`: the points of the rail classes of LAS, LAZ, COPC and .vpc files;
- `rails`: the lines that come out, with their figures;
- `standards`: rail standards by name, for gauge and railhead width;
- `errors` and `progress`: what an extraction raises, and how it reports.

All other modules may change at any time.

Examples
--------
Two rails of 12 m, scanned at 1000 points per metre:

>>> import numpy as np
>>> from rail_extract.core.clouds.points import RailPoints
>>> from rail_extract.core.frame import LocalFrame
>>> from rail_extract.core.parameters import Parameters
>>> from rail_extract.core.pipeline import extract_rails
>>> from rail_extract.core.standards import resolve
>>> standard = resolve("EN_60E1_1435")
>>> along, across = np.meshgrid(np.arange(0, 12, 0.02), np.linspace(-0.035, 0.035, 20))
>>> left, right = across + 0.7535, across - 0.7535
>>> xyz = [np.column_stack([along.ravel(), side.ravel(), np.full(along.size, 100.0)]) for side in (left, right)]
>>> points = RailPoints(np.concatenate(xyz), LocalFrame(np.zeros(3)), class_code=10)
>>> network = extract_rails([points], Parameters(standard.gauge_m, standard.head_width_m))
>>> [round(rail.length_m) for rail in network.rails]
[12, 12]
>>> [round(track.gauge_mm) for track in network.centerlines]
[1435]

From a file, the points are `read_rail_points("cloud.laz", [10])`.
"""

VERSION = "0.1.0"
"""Version of the plugin and of the package; a test compares it with `metadata.txt` and `pyproject.toml`."""
