"""The one writer of files that other programs open: LPS mm at every door; the tests read each back.

Slicer: ``.mrk.json`` curves, ``.seg.nrrd`` label maps, ``.vtp`` models, a ``.mrml`` scene of them.
ParaView: ``.vtp`` with point arrays, ``.pvd`` over frames. Others: ``.stl``.
"""

from reports.export.scene import wire_name, write_scene
from reports.export.slicer import write_markups_curve, write_segmentation_nrrd
from reports.export.stl import write_surface_stl
from reports.export.vtp import read_surface_vtp, write_collection, write_polyline_vtp, write_surface_vtp

__all__ = [
    "read_surface_vtp",
    "wire_name",
    "write_collection",
    "write_markups_curve",
    "write_polyline_vtp",
    "write_scene",
    "write_segmentation_nrrd",
    "write_surface_stl",
    "write_surface_vtp",
]
