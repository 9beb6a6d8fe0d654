# Rail Extract on Debian 12 and Ubuntu. `make demo` and `make test` set up all they need; `make` lists the targets.

SYSTEM_PYTHON ?= /usr/bin/python3
# Empty: without PyTorch.
TORCH ?= torch==2.13.0
# Builds for the processor; failing this, the package index gives those for CUDA, which are far larger.
TORCH_BUILDS ?= https://download.pytorch.org/whl/cpu
SUDO = $(if $(filter 0,$(shell id -u)),,sudo)
PYTHON = .venv/bin/python
CHECK = .check/bin/python
# The checkout under its import name, whatever its folder is called.
AS_PACKAGE = .check/src
ENVIRONMENT = build/environment.sh
# On all cores; tests of a file share what they made.
BY_FILE = -n auto --dist loadfile
# The walk through the whole and what runs it: `make check` tests it with the newest numpy, and tests of the plugin, of
# qgis_process and of the golden table run it with QGIS's packages.
WALK = $(addprefix --ignore=tests/core/,pipeline run jobs commands squares test_package.py)
TRAINING = tests/core/commands/test_train_classifier.py

# A new system has no list of packages yet.
INSTALL = exec >&2; $(SUDO) apt-get update -q && \
	$(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends
APT_PACKAGES = git qgis python3-qgis python3-venv python3-pip python3-numpy python3-scipy python3-matplotlib python3-pyproj
SYSTEM_MODULES = qgis.core numpy scipy matplotlib pyproj ensurepip

.PHONY: help
help:  ## list the targets
	@sed -n 's/^\([a-z0-9. -]*\):.*## /make \1 - /p' Makefile

.PHONY: demo
demo: plugin  ## extract the sample's rails through qgis_process; lines and map go into build/demo
	@. ./$(ENVIRONMENT) && $(PYTHON) tools/demo.py

.PHONY: check
check: lint  ## lint, types, import rules and the tests that need neither QGIS nor PyTorch; a few minutes
	@PYTHONPATH=$(AS_PACKAGE) $(CHECK) -m pytest -n auto tests/core tests/docs tests/tools tests/qt6

.PHONY: test
test: check plugin  ## run every test: check, core with PyTorch, plugin and, through qgis_process, the whole
	@. ./$(ENVIRONMENT) && $(PYTHON) -m pytest -n auto $(WALK) tests/core $(TRAINING) tests/laboratory tests/benchmarks
	@. ./$(ENVIRONMENT) && $(PYTHON) -m pytest $(BY_FILE) tests/plugin tests/e2e

.PHONY: test-desktop
test-desktop: plugin  ## test the real QGIS application on a virtual display
	@command -v xvfb-run > /dev/null || { $(INSTALL) xvfb xauth; }
	@. ./$(ENVIRONMENT) && $(PYTHON) -m pytest tests/desktop

.PHONY: golden golden-all
golden: .venv/installed  ## run every scene, and write its figures to benchmarks/golden.json
	@PYTHONPATH=$(AS_PACKAGE) $(PYTHON) benchmarks/golden.py --write

golden-all: .venv/installed  ## compare every scene with its figures, with the base model and three seeds, too; WRITE=--write writes
	@PYTHONPATH=$(AS_PACKAGE) $(PYTHON) benchmarks/golden.py --all $(WRITE)

.PHONY: ablation
ablation: .venv/installed  ## switch rules off one at a time, and print which golden figures need each; RULES=tracks. chooses, WORLDS=200 asks worlds
	@PYTHONPATH=$(AS_PACKAGE) $(PYTHON) $(if $(WORLDS),benchmarks/ablation_of_worlds.py --count $(WORLDS) $(if $(FROM),--from $(FROM)) $(if $(KIND),--kind $(KIND)),benchmarks/ablation.py) $(RULES)

.PHONY: worlds
worlds: .venv/installed  ## extract COUNT=100 worlds drawn at random, from seed FROM=1, raw and classified; SEED=7 draws one
	@PYTHONPATH=$(AS_PACKAGE) $(PYTHON) benchmarks/worlds.py --from $(or $(FROM),1) --count $(or $(COUNT),100) \
		$(if $(JOBS),--jobs $(JOBS)) $(if $(KIND),--kind $(KIND)) $(if $(SEED),--seed $(SEED))

.PHONY: fuzz
fuzz: plugin  ## read damaged files of every kind for MINUTES=5, from SEED=0; `tools/fuzz.py KIND:SEED` repeats one
	@. ./$(ENVIRONMENT) && $(PYTHON) tools/fuzz.py --minutes $(or $(MINUTES),5) --seed $(or $(SEED),0)

.PHONY: endure
endure: plugin  ## kill runs while they write, let pairs of runs write one output, and repeat a run two hundred times
	@. ./$(ENVIRONMENT) && $(PYTHON) tools/kills.py 50 && $(PYTHON) tools/races.py 20 && $(PYTHON) tools/growth.py 200

.PHONY: test-qgis
test-qgis: plugin  ## run the tests that need QGIS: plugin and, through qgis_process, the whole
	@. ./$(ENVIRONMENT) && "$$QGIS_PROCESS" --version | head -n 1 && $(PYTHON) -m pytest $(BY_FILE) tests/plugin tests/e2e

.PHONY: test-latest test-3.40
test-latest test-3.40: test-%:  ## run the same with Debian testing's QGIS, or with the backports' 3.40, in a chroot
	@command -v mmdebstrap > /dev/null || { $(INSTALL) mmdebstrap debian-archive-keyring; }
	@$(SUDO) $(SYSTEM_PYTHON) tools/chroot.py $* '$(TORCH)' $(TORCH_BUILDS) $(filter-out git,$(APT_PACKAGES))

.PHONY: lint
lint: .check/installed  ## check style, words, types and import rules
	@$(CHECK) -m ruff check . && $(CHECK) -m ruff format --check . && $(CHECK) tools/words.py
	@MYPYPATH=$(AS_PACKAGE) $(CHECK) -m mypy && PYTHONPATH=$(AS_PACKAGE) .check/bin/lint-imports --no-cache

.PHONY: env
env: plugin  ## print export lines for `$QGIS_PROCESS run railextract:extractrails`: eval "$(make -s env)"
	@cat $(ENVIRONMENT)

.PHONY: constants
constants: .check/installed  ## write every named number with its reason to build/constants.md
	@$(CHECK) tools/constants.py

.PHONY: size
size: .check/installed  ## count files and lines of each part, and named numbers, rooms and floors of the core
	@$(CHECK) tools/size.py

.PHONY: package
package: .venv/installed  ## build the plugin's zip, build/rail_extract.zip
	@$(PYTHON) tools/package.py

.PHONY: scan
scan: package  ## apply the plugin site's rules to the zip
	@$(PYTHON) tools/scan.py

.PHONY: contact-sheet
contact-sheet: .venv/installed  ## draw synthetic training pairs by family and severity, docs/contact_sheet.png
	@$(PYTHON) tools/contact_sheet.py

.PHONY: parameter-pictures
parameter-pictures: .venv/installed  ## draw what the parameters do, docs/pictures/parameters
	@$(PYTHON) tools/parameter_pictures.py

.PHONY: classification-pictures
classification-pictures: .venv/installed  ## draw the steps of the classification, docs/pictures/classification
	@$(PYTHON) tools/classification_pictures.py

.PHONY: screenshots
screenshots: plugin  ## take pictures of the dialogs and of the sample's result, docs/pictures
	@command -v chromium > /dev/null || { $(INSTALL) chromium; }
	@. ./$(ENVIRONMENT) && $(PYTHON) tools/screenshots.py

.PHONY: clean
clean:  ## remove what was built; .venv stays
	rm -rf build

.PHONY: clean-chroots
clean-chroots:  ## remove the other systems that test-latest and test-3.40 built
	$(SUDO) rm -rf .chroots

# The plugin as a user gets it, unpacked from the zip and enabled in a profile of its own.
.PHONY: plugin
plugin: package build/profile/enabled

build/profile/enabled: | $(ENVIRONMENT) package
	@. ./$(ENVIRONMENT) && "$$QGIS_PROCESS" plugins enable rail_extract > build/enable.log 2>&1 || { cat build/enable.log >&2; exit 1; }
	@touch $@

$(ENVIRONMENT): tools/environment.py .venv/installed
	@$(PYTHON) tools/environment.py > $@

# An environment without QGIS and PyTorch, for `make check`.
.check/installed: requirements.txt tools/check-requirements.txt pyproject.toml
	@$(SYSTEM_PYTHON) -c "import ensurepip" 2>/dev/null || { $(INSTALL) python3-venv; }
	@echo "Installing Python packages into .check" >&2
	@mkdir -p build && grep -v '^torch' requirements.txt > build/requirements-check.txt
	@$(SYSTEM_PYTHON) -m venv .check
	@$(CHECK) -m pip install --quiet -r build/requirements-check.txt -r tools/check-requirements.txt numpy scipy >&2
	@mkdir -p $(AS_PACKAGE) && ln -sfn ../.. $(AS_PACKAGE)/rail_extract
	@touch $@

# Packages over QGIS's own Python: numpy and scipy stay at the system's versions, which GDAL's bridge is built against.
.venv/installed: .venv/constraints.txt requirements.txt tools/requirements.txt pyproject.toml
	@echo "Installing Python packages into .venv" >&2
	@$(if $(TORCH),cat,grep -v '^torch') requirements.txt > build/requirements.txt
	@$(if $(TORCH),$(PYTHON) -m pip install --quiet --no-deps --retries 0 --extra-index-url $(TORCH_BUILDS) '$(TORCH)' >&2 || true)
	@$(PYTHON) -m pip install --quiet --constraint $< -r build/requirements.txt -r tools/requirements.txt >&2
	@$(PYTHON) -m pip install --quiet --no-deps --editable . >&2
	@touch $@

# Made again when the system's Python, numpy or scipy changes.
.venv/constraints.txt: system
	@mkdir -p build
	@$(SYSTEM_PYTHON) tools/constraints.py '$(TORCH)' > build/constraints.txt
	@cmp -s build/constraints.txt $@ || { \
		$(SYSTEM_PYTHON) -m venv --clear --system-site-packages .venv && cp build/constraints.txt $@; \
	}

.PHONY: system
system:
	@$(SYSTEM_PYTHON) tools/find_modules.py $(SYSTEM_MODULES) 2>/dev/null || { \
		echo "Installing QGIS from the distribution's packages$(if $(SUDO), with sudo): $(APT_PACKAGES)" >&2; \
		$(INSTALL) $(APT_PACKAGES); \
	}
