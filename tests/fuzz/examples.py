"""Inputs that once ended badly, with what they did: by kind, names among those of ``inputs``. Scans that did stand in
``tests.studies.formats``, each of which is a test."""

EXAMPLES = {
    "manifest": (
        # a traceback and exit 1
        "not UTF-8", "a name that is not UTF-8", "nested", "case = [1]", 'frames = "/**/*.mha"',
        f'frames = "{59 * "x"}',
        # taken, or found out after minutes
        "roll_deg = nan", "roll_deg = inf", "entry_mm = [nan, 0, 0]", "entry_direction = [inf, 0, 0]",
        "material_axis = [nan, 0, 1]", "radius_mm = nan", "bending_stiffness_N_mm2 = [[0, nan]]",
        "rest_curvature_per_mm = inf", "insertion_mm = []", 'reference = ""', "frames = []",
        # no regular files
        'frames = "fifo"', 'frames = "/dev/zero"', 'frames = "/proc/self/mem"', 'frames = "loop"',
        'reference = "frames"', 'lumen = "fifo"', 'lumen = "frames"', 'traces = "/dev/zero"', 'truth = "fifo"',
    ),
    "curve": ("truth 6", "truth 7", "a.csv 7", "a.mrk.json 15"),  # NaN; 1e9; 1e9; 1e9 mm
    # a needle 1e6 mm long; coordinates of 1e9; 5,000 shells; 4 GiB packed; entities
    "surface": ("a.stl 4", "a.stl 5", "a.stl 9", "a.vtp 3", "a.vtp 5"),
    "setting": (
        "segment.threshold=-1", "segment.outer_mm=nan", "segment.margin_mm=-1", "solver.step_mm=1e-6",
        "compare.sample_mm=1e-6",
    ),
}  # fmt: skip
