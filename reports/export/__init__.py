"""The one writer of files that other programs open: LPS mm at every door; the tests read each back.

Slicer: ``.mrk.json`` curves, ``.seg.nrrd`` label maps, ``.vtp`` models. ParaView: ``.vtp`` with point arrays.
"""

from reports.export.slicer import write_markups_curve, write_segmentation_nrrd
from reports.export.vtp import read_surface_vtp, write_polyline_vtp, write_surface_vtp

__all__ = [
    "read_surface_vtp",
    "write_markups_curve",
    "write_polyline_vtp",
    "write_segmentation_nrrd",
    "write_surface_vtp",
]
