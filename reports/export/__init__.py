"""The one writer of files that other programs open: LPS mm at every door, each read back by the tests.

Slicer: ``.mrk.json`` curves, ``.seg.nrrd`` label maps, ``.vtp`` models. ParaView: ``.vtp`` with point arrays.
"""

from reports.export.markups import read_markups_curve, write_markups_curve
from reports.export.segmentation import Labels, read_segmentation_nrrd, write_segmentation_nrrd
from reports.export.vtp import PolyData, read_vtp, write_polyline_vtp, write_surface_vtp

__all__ = [
    "Labels",
    "PolyData",
    "read_markups_curve",
    "read_segmentation_nrrd",
    "read_vtp",
    "write_markups_curve",
    "write_polyline_vtp",
    "write_segmentation_nrrd",
    "write_surface_vtp",
]
