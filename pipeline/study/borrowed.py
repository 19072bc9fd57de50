"""``entry = "case:ID"``: the clamp of another insertion of the same fixation, the only blind one that scans give."""

from collections.abc import Mapping

from pipeline.status import did_you_mean


def borrowing_problems(cases: Mapping[str, tuple[str, bool]]) -> list[str]:
    """A sentence for each case whose clamp is to be taken from where there is none.

    cases : by id, the case's ``entry`` and whether it has frames.
    """
    problems = []
    for case, (entry, _) in cases.items():
        name, others = entry.removeprefix("case:"), [other for other in cases if other != case]
        if name and name not in cases:
            problems.append(f"case {case!r}: entry = {entry!r}: no such case; {did_you_mean(name, others)}")
        elif name and (cases[name][0] or not cases[name][1]):
            what = "name one with frames of its own and no entry of another"
            problems.append(f"case {case!r}: entry = {entry!r} shows no clamp; {what}")
    return problems
