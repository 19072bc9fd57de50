"""Every way in which a scan may lie in files: ``python -m tests.studies.formats`` (make formats).

One small scan, known in mm and grey, is written in many variants, by SimpleITK, h5py, pydicom or byte by byte. Each is
to be read right, read right with a note of what was assumed, or refused with a sentence that names the trouble. The
last column, *wrong and silent*, is to be 0.
"""

from __future__ import annotations

from tests.studies.formats.base import Variant, outcome
from tests.studies.formats.contradictions import contradictions
from tests.studies.formats.dicom import dicom_variants
from tests.studies.formats.hdf5 import hdf5_variants
from tests.studies.formats.meta import itk_variants, meta_variants
from tests.studies.formats.nifti import nifti_variants
from tests.studies.formats.nrrd import nrrd_variants
from tests.studies.formats.other import other_variants

__all__ = ["Variant", "outcome", "variants"]


def variants() -> list[Variant]:
    each = (
        contradictions,
        itk_variants,
        meta_variants,
        nrrd_variants,
        nifti_variants,
        hdf5_variants,
        other_variants,
        dicom_variants,
    )
    return [variant for make in each for variant in make()]
