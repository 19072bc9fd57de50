# make validate   set up, build a study of real files, run the whole pipeline on it, say where the report lies
# make test       set up, then lint, types, import rules and tests
.PHONY: setup validate test lint study bars baseline anatomies bench stress peers aneurism conebeam seeing truth clean
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT := reports/out
SEED ?= 101
export OMP_NUM_THREADS := 1

validate: setup
	$(BIN)/wireval synth circle-of-willis -o $(OUT)/study --frames 30 --size 256 --seed $(SEED)
	$(BIN)/wireval run $(OUT)/study/manifest.toml -o $(OUT)/validate --resume \
	  --sweep simulate.bending_scale=0.8,1.2 --sweep simulate.wall_scale=0.333,3 --sweep simulate.roll_offset_deg=-15,15

test: setup lint
	$(BIN)/python -m pytest -q -n auto --maxprocesses 4 --dist loadfile

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

study: setup
	$(BIN)/python -m pytest -q -m slow

# the bars of the full study on seeds that nobody tuned on: one study of 30 frames each, then the table
SEEDS ?= 101 102 103
bars: setup
	for seed in $(SEEDS); do \
	  $(BIN)/wireval synth circle-of-willis -o $(OUT)/bars/$$seed --frames 30 --size 256 --seed $$seed && \
	  $(BIN)/wireval run $(OUT)/bars/$$seed/manifest.toml -o $(OUT)/bars/out-$$seed --resume || exit 1; done
	$(BIN)/python -m tests.studies.bars $(foreach seed,$(SEEDS),$(OUT)/bars/out-$(seed))

# the golden errors of the small catalogue, written anew: look at the difference before committing it
baseline: setup
	$(BIN)/python -m tests.studies.catalogue

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

# the truth against itself, every scene replayed on nodes half as far apart
truth: setup
	$(BIN)/python -m tests.studies.truth

# a real scan (needs WIREVAL_DATA): segmented, then a wire is simulated from the carotid past the aneurysm
aneurism: setup
	@if [ -z "$$WIREVAL_DATA" ]; then echo "skipped: set WIREVAL_DATA to the folder of real scans"; else \
	  mkdir -p $(OUT)/aneurism && cp tests/studies/aneurism/* $(OUT)/aneurism/ && \
	  ln -sf "$$WIREVAL_DATA/aneurism_3dra/aneurism.raw.gz" $(OUT)/aneurism/ && \
	  $(BIN)/wireval run $(OUT)/aneurism/manifest.toml -o $(OUT)/aneurism/out; fi

setup: $(VENV)/.ready

$(VENV)/.ready: pyproject.toml requirements.lock
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "wireval needs Python 3.11 or newer")'
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --editable .
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

clean:
	rm -rf $(OUT) build dist *.egg-info
