"""Every variant of the format study, and the files that pydicom tests itself with."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pydicom
import pytest

from pipeline.load import LoadError, load, read_header
from tests.studies.formats import Variant, outcome, variants
from tests.studies.formats.base import numbered
from tests.studies.formats.dicom import series

VARIANTS = variants()
OTHERS = sorted((Path(pydicom.__file__).parent / "data" / "test_files").glob("*.dcm"))


@pytest.mark.filterwarnings("ignore")  # writers warn of what is wrong on purpose
@pytest.mark.parametrize("variant", VARIANTS, ids=lambda variant: variant.name)
def test_it_is_right_or_noted_or_refused(tmp_path: Path, variant: Variant) -> None:
    found = outcome(variant, tmp_path)
    assert not found.startswith("wrong"), found


def test_the_table_is_large() -> None:
    assert len(VARIANTS) >= 120
    assert len({variant.name for variant in VARIANTS}) == len(VARIANTS)


@pytest.mark.parametrize("path", OTHERS, ids=lambda path: path.name)
def test_files_of_others_are_read_or_refused_in_a_sentence(path: Path) -> None:
    try:
        volume = load(read_header(path))
    except LoadError as error:
        assert path.name in str(error)  # noqa: PT017
    else:
        assert min(volume.shape) >= 2


def test_of_packed_slices_the_one_that_cannot_be_unpacked_is_named(tmp_path: Path) -> None:
    def finish(data: pydicom.FileDataset) -> None:
        data.compress(pydicom.uid.RLELossless)
        if data.InstanceNumber == 5:
            data.PixelData = pydicom.encaps.encapsulate([b"\xff" * 64])

    series("{k:02d}.dcm", values=np.pad(numbered(), ((0, 3), (0, 1), (0, 0))), finish=finish)(tmp_path)
    with pytest.raises(LoadError, match=r"06\.dcm: cannot be unpacked: ITK"):  # 7 * 4 % 11
        load(read_header(tmp_path))
