"""3D Slicer segmentations (.seg.nrrd): a label map with Slicer's metadata, through SimpleITK."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk
from numpy.typing import ArrayLike, NDArray

from reports.atomic import replacing


def write_segmentation_nrrd(
    path: Path,
    values: NDArray[Any],
    spacing_mm: ArrayLike,
    origin_mm: ArrayLike,
    direction: ArrayLike,
    segments: Sequence[str] = ("lumen",),
) -> None:
    """Write a label map (nx, ny, nz), label k being ``segments[k - 1]``, compressed.

    spacing_mm (3,); origin_mm (3,) LPS centre of voxel (0, 0, 0); direction (3, 3), column a = axis a in LPS.
    The name must end in .seg.nrrd, by which Slicer knows a segmentation.
    """
    if not path.name.endswith(".seg.nrrd"):
        raise ValueError(f"{path}: a segmentation's name must end in .seg.nrrd; Slicer would open it as a grey volume")
    # SimpleITK's numpy view is z, y, x; transposing here is the only place in this package where the two meet
    image: Any = sitk.GetImageFromArray(np.ascontiguousarray(np.asarray(values, dtype=np.uint8).T))
    image.SetSpacing(np.asarray(spacing_mm, dtype=np.float64).tolist())
    image.SetOrigin(np.asarray(origin_mm, dtype=np.float64).tolist())
    image.SetDirection(np.asarray(direction, dtype=np.float64).ravel().tolist())
    for key, text in _metadata(values.shape, segments).items():
        image.SetMetaData(key, text)
    with replacing(path) as temporary:
        sitk.WriteImage(image, str(temporary), useCompression=True)


def _metadata(shape: tuple[int, ...], segments: Sequence[str]) -> dict[str, str]:
    extent = " ".join(f"0 {n - 1}" for n in shape)
    common = {
        "Segmentation_MasterRepresentation": "Binary labelmap",  # read by Slicer 4.11 to 5.0
        "Segmentation_SourceRepresentation": "Binary labelmap",  # its name since 5.1
        "Segmentation_ContainedRepresentationNames": "Binary labelmap|",
        "Segmentation_ReferenceImageExtentOffset": "0 0 0",
    }
    for i, name in enumerate(segments):
        common |= {
            f"Segment{i}_ID": name.replace(" ", "_"),
            f"Segment{i}_Name": name,
            f"Segment{i}_LabelValue": str(i + 1),
            f"Segment{i}_Layer": "0",
            f"Segment{i}_Color": "0.8350 0.3690 0.0000",
            f"Segment{i}_Extent": extent,
        }
    return common
