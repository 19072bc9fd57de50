"""Why a case, or a run, has no score."""

from collections.abc import Iterable

OF_CALIBRATION = (
    "It is a calibration case and not scored: parameters are learnt from it, so its errors say nothing about the "
    "simulator and stand in no score of the run."
)


def unscored(cases: Iterable[tuple[str, str]]) -> str:
    """Why a run has no error over all its cases; empty where one was to be scored. cases : role and status of each."""
    known = [(str(role), str(status)) for role, status in cases]
    learnt = [role == "calibration" for role, _ in known]
    if known and all(learnt):
        return (
            'Nothing is scored: wireval calibrate learns from every case (role = "calibration", or taken for its '
            'parameters), and such frames say nothing about the simulator; add insertions of role = "validation".'
        )
    if known and all(own or status == "simulated" for own, (_, status) in zip(learnt, known, strict=True)):
        return "Nothing is scored: no case has scans, traces or projections of a real wire to be compared with."
    return ""
