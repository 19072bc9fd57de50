# make validate   set up, build a study of real files, run the whole pipeline on it, say where the report lies
# make test       set up, then lint, types, import rules and tests
.PHONY: setup validate planted calibrated test pytest browser lint package docs pages study bars budget baseline anatomies bench stress peers aneurism liver conebeam seeing truth interrupt scale coverage mutants numbers bounds shuffled cluster clean formats fuzz audit
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT := reports/out
SEED ?= 101
CALIBRATED ?= 200 201 202
export OMP_NUM_THREADS := 1

validate: setup
	$(BIN)/wireval synth circle-of-willis -o $(OUT)/study --insertions 6 --frames 10 --size 256 --seed $(SEED) -j 2
	$(BIN)/wireval run $(OUT)/study/manifest.toml -o $(OUT)/validate --resume -j 2 --set budget.members=100 \
	  --sweep simulate.roll_offset_deg=-15,15 --sweep simulate.taper_scale=0.5,2 \
	  --sweep simulate.rest_curvature_scale=0.8,1.2 --sweep simulate.friction=0.2

# errors planted into the simulator of the same study: sweep.csv has the skill that is left to each
planted: setup
	$(BIN)/wireval synth circle-of-willis -o $(OUT)/study --insertions 6 --frames 10 --size 256 --seed $(SEED) -j 2
	$(BIN)/wireval run $(OUT)/study/manifest.toml -o $(OUT)/planted --resume -j 2 --until compare \
	  --sweep simulate.roll_offset_deg=-60,60 --sweep simulate.rest_curvature_scale=0 \
	  --sweep simulate.taper_scale=2 --sweep simulate.friction=0.2
	$(BIN)/wireval synth circle-of-willis -o $(OUT)/rough --friction 0.2 --insertions 6 --frames 10 --size 256 --seed $(SEED) -j 2
	$(BIN)/wireval run $(OUT)/rough/manifest.toml -o $(OUT)/planted-rough --resume -j 2 --until compare \
	  --sweep simulate.friction=0

# parameters found by `wireval calibrate` against the truth, and six blind insertions judged with them
calibrated: setup
	$(BIN)/python -m tests.studies.calibration $(OUT)/calibrated --seed $(CALIBRATED)
	$(BIN)/python -m tests.studies.calibration $(OUT)/calibrated --seed $(CALIBRATED) --forces --no-blind

# types are checked on one core while tests run on what is left
test: setup
	$(MAKE) --no-print-directory -j 2 lint pytest

pytest: setup
	$(BIN)/python -m pytest -q -n auto --maxprocesses 4 --dist loadfile --no-loadscope-reorder

# the pages in a browser (needs a Chromium on the path, and the network once)
browser: setup
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[browser]'
	$(BIN)/python -m pytest -q tests/reports/test_browser.py

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# the wheel as a user gets it: built (what an earlier one left in build would go into it), installed where nothing is,
# outside the checkout, and run there
AWAY = $(abspath $(OUT))/package
package: setup
	rm -rf $(AWAY) build && mkdir -p $(AWAY)/wheel
	$(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir $(AWAY)/wheel .
	$(PYTHON) -m venv $(AWAY)/venv
	$(AWAY)/venv/bin/python -m pip install --quiet --disable-pip-version-check $(AWAY)/wheel/*.whl
	# what the checkout has compiled need not be compiled again: it goes by the sources' contents
	find solver pipeline data_synthetic -name '*.nb[ic]' | tar -cf - -T - | tar -xf - -C $(AWAY)/venv/lib/python3*/site-packages
	cd $(AWAY) && venv/bin/wireval synth straight -o study && venv/bin/wireval run study -o out
	cd $(AWAY) && venv/bin/python -c 'import wireval; assert wireval.read_results("out").ok, "not all frames are ok"'
	cd $(AWAY) && $(abspath $(BIN))/mypy --config-file /dev/null --strict --python-executable venv/bin/python \
	  -c 'import wireval; wireval.run("study", "out").errors.plot()'

# the pages of docs/ that are written from the code
pages: setup
	$(BIN)/python -m tests.studies.reference_pages

# the manual as a site, in an environment of its own; a broken link is an error
DOCS = "mkdocs-material>=9.5" "mkdocs-jupyter>=0.25"
docs: export NO_MKDOCS_2_WARNING = 1
docs:
	test -x $(OUT)/docs/bin/mkdocs || $(PYTHON) -m venv $(OUT)/docs
	test -x $(OUT)/docs/bin/mkdocs || $(OUT)/docs/bin/python -m pip install --quiet --disable-pip-version-check $(DOCS)
	$(OUT)/docs/bin/mkdocs build --strict --site-dir $(abspath $(OUT))/site

study: setup
	$(BIN)/python -m pytest -q -n auto --maxprocesses 4 --dist loadfile -m slow

# the bars of the full study on seeds that nobody tuned on: one study of 30 frames each, then the table
SEEDS ?= 101 102 103
bars: setup
	for seed in $(SEEDS); do \
	  $(BIN)/wireval synth circle-of-willis -o $(OUT)/bars/$$seed --frames 30 --size 256 --seed $$seed && \
	  $(BIN)/wireval run $(OUT)/bars/$$seed/manifest.toml -o $(OUT)/bars/out-$$seed --resume || exit 1; done
	$(BIN)/python -m tests.studies.bars $(foreach seed,$(SEEDS),$(OUT)/bars/out-$(seed))

# how far the uncertainty budget is right: insertions with inputs as far off as it says, and with errors planted
budget: setup
	$(BIN)/python -m tests.studies.budget $(OUT)/budget

# the golden errors of the small catalogue, written anew: look at the difference before committing it
baseline: setup
	$(BIN)/python -m tests.studies.catalogue

# the kept numbers of small scenes, written anew: look at the difference, and say why, before committing it
numbers: setup
	$(BIN)/python -m tests.numbers

# five BraVa trees and the aorta-to-cranial tree (needs WIREVAL_DATA): errors and statuses frame by frame
anatomies: setup
	$(BIN)/python -m tests.studies.anatomies

# one study by the ideal scanner and as 3D rotational X-ray (needs the network once, 1.6 GB): errors beside each other
conebeam:
	test -x $(OUT)/rtk/bin/python || $(PYTHON) -m venv $(OUT)/rtk
	$(OUT)/rtk/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[conebeam]'
	$(OUT)/rtk/bin/python -m tests.studies.conebeam $(OUT)/conebeam --seed $(SEED)

# wires and vessels that it is tempting to get wrong, by a renderer of its own: right, refused, wrong and called ok
seeing: setup
	$(BIN)/python -m tests.studies.seeing.table --jobs 2

# every way to write a scan: right, noted, refused, or wrong and silent (the last is 0)
formats: setup
	$(BIN)/python -W ignore -m tests.studies.formats

# malformed inputs, each in a process of its own: nothing crashes, hangs, dies or is believed (an hour)
COUNT ?= 2000
fuzz: setup
	$(BIN)/python -W ignore -m tests.fuzz --count $(COUNT) --seed $(SEED)

# a dask scheduler with two workers on loopback, one of them killed (needs the network once)
cluster: setup
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --target $(OUT)/cluster 'distributed>=2024.5'
	PYTHONPATH=$(OUT)/cluster $(BIN)/python -m pytest -q tests/pipeline/test_cluster.py

# known weaknesses of the locked packages (needs the network)
audit:
	test -x .audit/bin/pip-audit || { $(PYTHON) -m venv .audit && \
	  .audit/bin/python -m pip install --quiet --disable-pip-version-check pip-audit; }
	.audit/bin/pip-audit --require-hashes --disable-pip --requirement requirements.lock

# the truth against itself, every scene replayed on nodes half as far apart
truth: setup
	$(BIN)/python -m tests.studies.truth

# a real scan (needs WIREVAL_DATA): segmented, then a wire is simulated from the carotid past the aneurysm
aneurism: setup
	@if [ -z "$$WIREVAL_DATA" ]; then echo "skipped: set WIREVAL_DATA to the folder of real scans"; else \
	  mkdir -p $(OUT)/aneurism && cp tests/studies/aneurism/* $(OUT)/aneurism/ && \
	  ln -sf "$$WIREVAL_DATA/aneurism_3dra/aneurism.raw.gz" $(OUT)/aneurism/ && \
	  $(BIN)/wireval run $(OUT)/aneurism/manifest.toml -o $(OUT)/aneurism/out; fi

# 37 real X-ray frames of a liver artery (needs WIREVAL_DATA): a simulated wire over the wire that was seen
liver: setup
	@if [ -z "$$WIREVAL_DATA" ]; then echo "skipped: set WIREVAL_DATA to the folder of real scans"; else \
	  $(BIN)/python -m tests.studies.liver $(OUT)/liver; fi

setup: $(VENV)/.ready

$(VENV)/.ready: pyproject.toml requirements.lock
	@test ! -L $(VENV) || { echo "$(VENV) is a link: setup would install into what it points at; remove the link"; exit 1; }
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "wireval needs Python 3.11 or newer")'
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --editable .
	# where Python is told not to write bytecode (in containers) every start would read all sources anew: seconds. On
	# all cores, and without others' tests, in half the time that pip takes for it
	-$(BIN)/python -m compileall -q -j 0 -x '/tests?/' $(VENV)/lib
	$(BIN)/python -m compileall -q pipeline solver reports data_synthetic
	$(BIN)/python -m pipeline.warm_up
	touch $@

# run time against error with the promised figures; 5,000 random scenes; other simulators (needs the network once)
bench: setup
	$(BIN)/wireval bench -o $(OUT)/bench

stress: setup
	$(BIN)/wireval bench -o $(OUT)/bench --stress --seed $(SEED)

peers: setup
	test -x $(OUT)/peers/bin/python || $(PYTHON) -m venv $(OUT)/peers
	$(OUT)/peers/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[peers]'
	$(OUT)/peers/bin/wireval bench -o $(OUT)/bench --peers

# 60 runs that are ended by signals and resumed, against one that was not
interrupt: setup
	$(BIN)/python -m tests.studies.interrupt --seed $(SEED)

# many small cases with a sweep on two workers and one, beside a busy loop
scale: setup
	$(BIN)/python -m tests.studies.scale

# all tests with coverage, in a random order: the modules of which less than 80 % of the lines are executed
COVERAGE = $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --target $(OUT)/coverage coverage
coverage: setup
	$(COVERAGE)
	$(BIN)/python -m tests.studies.executed --site $(OUT)/coverage -- \
	  -n 2 --dist loadfile -p randomly --randomly-seed=$(SEED)

# 100 random changes of product lines, each against the tests that execute them: the share that is noticed (hours)
mutants: setup
	$(COVERAGE)
	$(BIN)/python -m tests.studies.mutants --seed $(SEED) --site $(OUT)/coverage -- -n 2 --dist loadfile

# scans that nobody would scan, every index of compiled code checked: by itself it reads on beyond an array
bounds: setup
	NUMBA_BOUNDSCHECK=1 NUMBA_CACHE_DIR=$(OUT)/bounds $(BIN)/python -W error -m tests.studies.odd_scans
	NUMBA_BOUNDSCHECK=1 NUMBA_CACHE_DIR=$(OUT)/bounds $(BIN)/python -m pytest -q -p no:cacheprovider tests/solver \
	  tests/pipeline -k "solver or segment or trace or seeing or register or imaging or labelled or ends or wall"

# all tests in three random orders
shuffled: setup
	for seed in 1 2 3; do \
	  $(BIN)/python -m pytest -q -n auto --maxprocesses 4 --dist loadfile -p randomly --randomly-seed=$$seed || exit 1; done

clean:
	rm -rf $(OUT) build dist *.egg-info
