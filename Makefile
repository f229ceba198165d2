# Bare `make` lists the verbs. `run` and `test` set themselves up: they need python3 (3.11 or newer) and a package index.
PORT ?= 8000
SCENE ?=
PROBE ?=
FILE ?=
MACHINE ?= aarch64
SYSTEM ?= bookworm
KEY ?= $(HOME)/.config/tsis/release_key
OUT ?= dist
COUNTER ?=
SIGNERS ?=
HOST ?=
SERIAL ?=
LOGIN ?= pi
SSH ?=
TIME_ZONE ?=
TIME_SERVERS ?=
CHECK ?=
KILLS ?= 200
CUTS ?= 100
SAMPLED := $(addprefix tests/,device/update/test_killed.py device/update/test_full_disk.py browser/test_screen_scenarios.py)
TRUSTED ?= $(HOME)/.config/tsis/release_signers
DEPLOY_KEY ?= $(HOME)/.ssh/id_ed25519.pub
PY := .venv/bin/python
HOST_TOOLS := .venv/bin/host_tools
export OPENBLAS_NUM_THREADS ?= 1
# The tests start hundreds of interpreters: without its cache each would compile the sources anew.
unexport PYTHONDONTWRITEBYTECODE
.DEFAULT_GOAL := help
.PHONY: help setup run test test-all loop test-camera-virtual test-systemd test-power-cuts torture studies test-arm test-deploy bundle provision deploy check fuzz bench verify sweep train evaluate modes tradeoff pages measure lock clean

help: ## list the verbs
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 22

.venv/bin/python:
	@python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "Python 3.11 or newer is needed: install python3."; exit 1; }
	@python3 -m venv .venv || { rm -rf .venv; echo "python3 has no venv module: install it (Debian: python3-venv)."; exit 1; }

# The device's part is a fifth of the whole: `make run` installs only that.
.venv/device.stamp: requirements/device.lock | .venv/bin/python
	$(PY) -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/device.lock
	@touch $@

.venv/all.stamp: requirements/all.lock pyproject.toml .venv/device.stamp
	$(PY) -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/all.lock
	$(PY) -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@

setup: .venv/all.stamp ## make the virtual environment .venv with everything

# A probe's file is read by the toolkit, which needs everything.
run: $(if $(PROBE),.venv/all.stamp,.venv/device.stamp) ## start the simulated probe: make run [PORT=8000] [SCENE=FILE, or PROBE=probe.toml]
	@$(if $(PROBE),mkdir -p build && $(HOST_TOOLS) probe scene "$(PROBE)" --out build/probe_scene.toml)
	@exec $(PY) -m device --simulate --port $(PORT) $(if $(PROBE),--scene build/probe_scene.toml,$(if $(SCENE),--scene $(SCENE)))

test: .venv/all.stamp ## run the tests, but for the long ones (four minutes)
	$(PY) -m pytest -n auto --maxprocesses 4 -m "not long"

test-all: .venv/all.stamp ## run all tests but studies, as continuous integration does (half an hour)
	$(PY) -m pytest -n auto --maxprocesses 4 -m "not study"

loop: .venv/all.stamp ## run the tests of one module's room, in seconds: make loop FILE=device/web/app.py
	@tests=$$($(PY) tests/room.py "$(FILE)") && $(PY) -m pytest -n auto --maxprocesses 4 -m "not long" $$tests

test-camera-virtual: ## run the camera's contract on real picamera2, in a Debian chroot under build (root, 1.7 GB)
	tests/libcamera/run.sh build/trixie

test-systemd: ## run the unit under a real systemd, in a Debian container under build (root, 0.9 GB, four minutes)
	tests/systemd/run.sh build/bookworm

test-power-cuts: .venv/all.stamp ## cut the power fifty times while releases are installed, on a disk in a file (root, three minutes)
	$(PY) tests/deploy/power_cuts.py

torture: .venv/all.stamp ## kill the daemon 200 times in presses, cut its power 100 times, its store's 100 times while that keeps on writing, each step of an update once, and show each scenario on the screen (root for the cuts, more than an hour): make torture [KILLS=200] [CUTS=100]
	$(PY) tests/torture/kills.py --kills $(KILLS)
	$(PY) tests/torture/daemon_cuts.py --cuts $(CUTS)
	$(PY) tests/torture/cuts.py --cuts $(CUTS)
	TSIS_EVERY_CASE=1 $(PY) -m pytest -n auto --maxprocesses 4 $(SAMPLED)

studies: .venv/all.stamp ## run the tests that judge what many presses and solves say, which test-all leaves out (ten minutes)
	$(PY) -m pytest -n auto --maxprocesses 4 -m study

test-arm: .venv/all.stamp ## install a release file for an arm in an emulated Debian under build, compare its answers with this machine's (root, 2 GB, a quarter of an hour): make test-arm [SYSTEM=trixie]
	tests/deploy/arm64.sh build/arm64/$(SYSTEM) $(SYSTEM)

test-deploy: .venv/all.stamp ## make a container a probe by ssh and send it releases, good and bad (root, network, 6 GB, ten minutes and more)
	tests/deploy/run.sh build/deploy

bundle: .venv/all.stamp ## build and sign the file that a probe installs: make bundle [SYSTEM=trixie] [MACHINE=aarch64] [KEY=FILE] [OUT=dist] [COUNTER=N] [SIGNERS=FILE]
	@$(HOST_TOOLS) release build --system $(SYSTEM) --machine $(MACHINE) --key $(KEY) --out $(OUT) \
	  $(if $(COUNTER),--counter $(COUNTER)) $(if $(SIGNERS),--signers $(SIGNERS))

RELEASE = $(or $(FILE),$(OUT)/tsis-$(shell sed -n 's/^__version__ = "\(.*\)"/\1/p' device/__init__.py)-$(SYSTEM)-$(MACHINE).release)

provision: .venv/all.stamp ## make a fresh Raspberry Pi OS a probe: make provision HOST=NAME SERIAL=TSIS-0007 [SYSTEM=trixie] [CHECK=1] [LOGIN=pi] [TIME_ZONE=Europe/Berlin] [TIME_SERVERS=ntp.hospital.example] [CAMERA=imx296] [SSH="-p 22"] [FILE=RELEASE]
	@test -n "$(HOST)" || { echo "Name the machine: make provision HOST=raspberrypi.local SERIAL=TSIS-0007"; exit 2; }
	@$(if $(FILE),true,$(MAKE) --no-print-directory bundle)
	@$(HOST_TOOLS) provision "$(RELEASE)" --host "$(HOST)" --user "$(LOGIN)" --signers "$(TRUSTED)" --deploy-key "$(DEPLOY_KEY)" \
	  $(if $(SSH),--ssh "$(SSH)") $(if $(SERIAL),--serial "$(SERIAL)") $(if $(TIME_ZONE),--time-zone "$(TIME_ZONE)") \
	  $(if $(TIME_SERVERS),--time-servers "$(TIME_SERVERS)") $(if $(CAMERA),--camera-overlay "$(CAMERA)") $(if $(CHECK),--check)

deploy: .venv/all.stamp ## build a release and send it to a probe: make deploy HOST=NAME [SYSTEM=trixie] [SSH="-p 22 -i KEY"] [FILE=RELEASE]
	@test -n "$(HOST)" || { echo "Name the probe: make deploy HOST=raspberrypi.local"; exit 2; }
	@$(if $(FILE),true,$(MAKE) --no-print-directory bundle)
	@$(HOST_TOOLS) deploy "$(RELEASE)" --host "$(HOST)" --signers "$(TRUSTED)" $(if $(SSH),--ssh "$(SSH)")

check: .venv/all.stamp ## lint, format, types, import arrows, systemd's units, shell scripts, dead links, pages that are their results in their templates, the API's document
	.venv/bin/ruff check .
	.venv/bin/ruff format --check .
	.venv/bin/mypy
	.venv/bin/lint-imports
	$(PY) -m pytest -rs --durations 0 --durations-min 9 tests/test_systemd_units.py tests/test_shell_scripts.py
	$(PY) tests/dead_links.py
	$(HOST_TOOLS) pages --check
	$(PY) -m device openapi --check docs/openapi.json

fuzz: .venv/all.stamp ## send some three thousand requests that schemathesis makes of the API's document to a simulated probe (four minutes): make fuzz [EXAMPLES=55]
	$(PY) tests/schema_fuzz.py $(or $(EXAMPLES),55)

bench: .venv/all.stamp ## time everything that somebody waits for, in one table that fails where a bound is missed: make bench [ONLY="work darkness"] [RUNS=3] [JSON=FILE] [COMPARE=FILE] [OUT=docs/speed.md]
	$(PY) tests/bench.py $(ONLY) $(if $(RUNS),--runs $(RUNS)) $(if $(JSON),--json $(JSON)) $(if $(COMPARE),--compare $(COMPARE)) $(if $(OUT),--out $(OUT))

verify: .venv/all.stamp ## check forward model and light against known answers; write docs/verification.md and optics.md
	$(HOST_TOOLS) optics verify --mitsuba --out docs/optics.md
	$(HOST_TOOLS) verify --extremes --effectivity --out docs/verification.md

sweep: .venv/all.stamp ## solve the 134 scenes of the training set into build/sweep.nc
	$(HOST_TOOLS) sweep --scenes 134 --seed 1 --out build/sweep.nc

train: .venv/all.stamp ## regenerate everything in models/ from nothing (some hours)
	$(HOST_TOOLS) train --mode all

modes: .venv/all.stamp ## measure what the modes of a press are worth; write docs/modes.md
	$(HOST_TOOLS) modes --out docs/modes.md

tradeoff: .venv/all.stamp ## measure what accuracy costs, as Pareto fronts; write docs/tradeoff.md (under half an hour)
	$(HOST_TOOLS) tradeoff --out docs/tradeoff.md

evaluate: .venv/all.stamp ## score the committed model, noise-free and through the camera
	$(HOST_TOOLS) evaluate

pages: .venv/all.stamp ## write the pages of docs/results from docs/templates, without measuring
	$(HOST_TOOLS) pages

measure: sweep ## measure again what docs/accuracy.md and paper_protocol.md say, and write them
	$(HOST_TOOLS) limits --map --out docs/accuracy.md
	$(HOST_TOOLS) paper --out docs/paper_protocol.md

lock: .venv/all.stamp ## choose and pin newest versions again
	$(PY) -m pip install --quiet uv
	$(PY) -m uv pip compile $(LOCK) -o requirements/device.lock pyproject.toml requirements/build.in
	$(PY) -m uv pip compile $(LOCK) -o requirements/all.lock --extra host --extra dev pyproject.toml requirements/build.in
LOCK := --quiet --upgrade --universal --python-version 3.11 --generate-hashes --no-header --no-emit-index-url

clean: ## remove the virtual environment and what was built
	rm -rf .venv build *.egg-info
