"""Failures of many frames that say the same."""

from __future__ import annotations

from reports.alike import alike, in_words, of_what
from reports.case_files import frames_named


def row(frame: int | None, message: str, case: str = "a", status: str = "no_wire") -> dict[str, object]:
    return {"case": case, "frame": frame, "stage": "trace", "status": status, "message": message}


def test_what_differs_in_numbers_and_scans_is_said_once() -> None:
    """A wrong entry without a reference said the same of each of 30 frames, a line each."""
    rows = [row(n, f"got nothing above {200 + n}.5 grey (scan frame_{n:03}.mha)") for n in (0, 1, 2, 5)]
    rows += [
        row(3, "got a line 1.1 noises bright"),
        row(0, "got nothing above 3 grey", case="b"),
        row(None, "no lumen"),
    ]
    found = alike(rows)
    assert [(one["case"], one["frames"], one["count"]) for one in found] == [
        *[("a", "0 to 2, 5", 4), ("a", "3", 1), ("b", "0", 1), ("a", "", 1)]
    ]
    assert found[0]["message"] == rows[0]["message"], "the first one's, numbers and all"


def test_a_case_without_any_result_is_no_third_frame() -> None:
    """Two failed frames and a failed case were ``Failures (3)`` below ``32 without a result``."""
    rows = [row(10, "faint 1"), row(20, "faint 2"), row(None, "no lumen", case="b")]
    assert of_what(alike(rows)) == "2 frames, 1 case"
    assert of_what(alike(rows[2:])) == "1 case"


def test_a_frame_that_failed_for_two_simulators_is_one_frame() -> None:
    """index.html of a score counted it once a simulator: "4 frames" of a case that has three."""
    rows = [row(n, f"no wire {n}") | {"simulator": name} for name in ("wireval", "mine") for n in (1, 2)]
    rows += [row(None, "no lumen", case="b") | {"simulator": name} for name in ("wireval", "mine")]
    assert of_what(alike(rows)) == "2 frames, 1 case"


def test_other_statuses_are_not_alike() -> None:
    assert len(alike([row(0, "x"), row(1, "x", status="trace_failed")])) == 2


def test_numbers_of_frames_in_words() -> None:
    assert in_words([4]) == "4"
    assert in_words([0, 1, 3, 4, 5]) == "0, 1, 3 to 5"


def test_all_files_that_cannot_be_read_are_named() -> None:
    """Of two damaged scans terminal and page named the first."""
    rows = [row(n, f"s/frames/frame_{n:03}.mha: the file is cut short", status="load_failed") for n in (1, 3)]
    (found,) = alike(rows)
    assert found["files"] == "frame_001.mha, frame_003.mha"
    assert alike(rows[:1])[0]["files"] == "", "the message names it"
    (many,) = alike([row(n, f"s/{n}.mha: cut short") for n in range(8)])
    assert many["files"] == "0.mha, 1.mha, 2.mha, 3.mha, 4.mha, 5.mha and 2 more"
    (same,) = alike([row(n, f"depth_{n}/recon.mha: cut short") for n in (0, 1)])
    assert same["files"] == "depth_0/recon.mha, depth_1/recon.mha", "one name of several files tells nothing"
    assert alike([row(n, f"trace: brightest ridge at CNR {n}.3") for n in (0, 1)])[0]["files"] == ""


def test_frames_are_named_as_one_or_as_several() -> None:
    assert frames_named([4]) == "frame 4"
    assert frames_named(["4 (-0.50 mm)", 7]) == "frames 4 (-0.50 mm), 7"
    assert frames_named(range(14)) == "frames 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11 and 2 more"
