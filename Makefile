# Two commands: `make demo` and `make test`. Both set up what they need first.
.DEFAULT_GOAL := help
.PHONY: help setup demo test campaign native mega sitl lint format bench study judgement tune-bench fleet-bench live-bench flight-bench imu-bench faults power-cuts card-images fuzz mutants hw clean docs release input-flights ideas ground-triggers hold-flights
PYTHON := .venv/bin/python
PIO := .venv/bin/pio
# Runs a module of tests/chip in that folder; what it imports lies elsewhere.
CHIP_PYTHON := PYTHONPATH=../simulator:../..:../../firmware/toolchain ../../$(PYTHON)
# All are run: one that misses a limit does not hide the others.
BENCHES := run identification identification_equations identification_imported after_landing
# mkfs.vfat and fsck.vfat live where only root looks.
export PATH := $(PATH):/usr/sbin:/sbin

help: ## list the targets
	@sed -nE 's/^([a-z-]+):.*## (.*)/  make \1\t\2/p' Makefile | expand -t 22

setup: ## put everything needed into .venv and this clone
	@.ci/setup.sh

demo: ## fly a virtual flight through the recorder, identify it, open the report (DEMO=--no-open)
	@.ci/setup.sh demo
	@$(PYTHON) tests/sitl/virtual_demo.py $(DEMO)

test: setup ## run every test (STAGES="lint native" runs some)
	@$(PYTHON) .ci/stages.py $(STAGES)

campaign: setup mega sitl ## cases that repeat those of `make test` on more images, seeds and inputs (before a release)
	@$(PYTHON) -m pytest -m campaign --numprocesses=2 --dist=loadfile tests

docs: setup sitl ## pages as a searchable site, with the API and the notebooks run: build/docs/site
	@python3 .ci/docs/site.py

release: setup ## wheel, images of both compilers, list of parts and hashes: build/release
	@$(PYTHON) .ci/release.py

native: setup ## unit tests of the firmware on this computer
	@$(PIO) test -e native

mega: setup ## image of the Mega
	@$(PIO) run

sitl: ## the firmware as a shared library for this computer
	@.ci/setup.sh demo
	@$(PYTHON) firmware/toolchain/build_sitl.py

lint: setup ## format, lint and types, nothing else
	@$(PYTHON) .ci/stages.py format lint types

format: setup ## rewrite C++ and Python in the house format
	@find firmware tests protocol -name '*.[hc]' -o -name '*.cpp' | grep -v /generated/ | xargs .venv/bin/clang-format -i
	@.venv/bin/ruff format --quiet .

bench: setup ## damage, speed and identification against their peers
	@bad=0; for part in $(BENCHES); do $(PYTHON) tests/bench/$$part.py || bad=$$?; done; exit $$bad

study: setup sitl ## tables and pictures of identification in build/study, nine minutes (SIZE=full: two hours)
	@cd host && ../$(PYTHON) -m studies ../build/study --size $(or $(SIZE),small)

tune-bench: setup sitl ## gains of one identified flight flown on 200 aircraft: margins by injected sines, steps, gusts (AUTOPILOT=px4, inav, mega; five minutes of a core for ArduPlane)
	@cd host && ../$(PYTHON) -m studies.tuned_flights $(if $(AUTOPILOT),--autopilot $(AUTOPILOT)) $(TUNE_BENCH)

judgement: setup sitl ## one score of answers over worlds: right, wrong, refused, honest; four flights a world, eight minutes of a core (SIZE=full: 200, a night; FLIGHTS=n)
	@cd host && ../$(PYTHON) -m studies.judgement --size $(or $(SIZE),small) $(if $(FLIGHTS),--flights $(FLIGHTS)) $(if $(FIRST),--first $(FIRST))

flight-bench: setup ## load, stack, pulse errors and losses of the Mega's image on the simulated chip
	@cd tests/chip && { $(CHIP_PYTHON) -m flight.bench $(BENCH); bad=$$?; $(CHIP_PYTHON) -m imu.bench --minutes 1 && exit $$bad; }

fleet-bench: setup sitl ## flights an hour of `host fleet`, its overhead, 10 000 tasks, what 10^6 flights would cost (ten minutes)
	@$(PYTHON) tests/bench/fleet_bench.py $(FLEET_BENCH)

live-bench: setup ## redraws, latency, load and memory of `host live` with Chromium (five minutes, on a quiet machine)
	@$(PYTHON) tests/bench/live_bench.py $(LIVE_BENCH)

imu-bench: setup ## the IMU's image and the Mega's on one bus for ten minutes, sample by sample
	@cd tests/chip && $(CHIP_PYTHON) -m imu.bench $(IMU_BENCH)

faults: setup ## faults in flight on the simulated chip
	@cd tests/chip && { $(CHIP_PYTHON) -m flight.faults $(FAULTS); bad=$$?; $(CHIP_PYTHON) -m imu.faults && exit $$bad; }

power-cuts: setup sitl ## power cuts in flight and at every write of metadata, and the next boot (a quarter of an hour)
	@cd tests/chip && $(CHIP_PYTHON) -m flight.power_cuts $(CUTS)

hw: ## check schematic, board and mechanics in KiCad and CAD (asks for an apt source; minutes)
	@.ci/setup.sh hw
	@.venv-hw/bin/python -m pytest --noconftest tests/hw/campaign/check_*.py

ideas: setup sitl ## count what a reader must know: files, functions, filters, verdicts and numbers of identification
	@PYTHONPATH=host $(PYTHON) -m tests.ideas $(IDEAS) $(if $(LITERALS),--change $(LITERALS))

mutants: setup ## share of mutants of core and drivers that their unit tests kill, 95 % wanted (hours; goes on)
	@$(PYTHON) -m tests.mutants $(MUTANTS)

fuzz: setup ## random input, guided by coverage: 2000 of each kind (FULL=1: all, an hour or two)
	@$(PYTHON) -m tests.fuzz $(FUZZ) $(if $(FULL),--full)

card-images: setup sitl ## 10 000 cards altered at random, under sanitizers, and 200 on the simulated chip
	@$(PYTHON) tests/sitl/card_images.py $(IMAGES); bad=$$?; cd tests/chip && $(CHIP_PYTHON) -m flight.card_images $(CHIP_IMAGES) && exit $$bad

input-flights: setup sitl ## 1000 random flights with a flight card, a fault at any instant of an input (minutes)
	@$(PYTHON) tests/sitl/input_faults.py $(INPUTS)

hold-flights: setup sitl ## 2000 random flights whose rows hold bank and pitch, 100 more of each fault (twenty minutes of a core)
	@$(PYTHON) tests/sitl/hold_faults.py $(HOLDS)

ground-triggers: setup sitl ## 10 200 triggers on the ground, none starts a row, and 5400 honest ones; the image on the chip
	@$(PYTHON) tests/sitl/ground_triggers.py $(GROUND); bad=$$?; cd tests/chip && $(CHIP_PYTHON) -m flight.ground_triggers $(CHIP_GROUND) && exit $$bad

clean: ## remove what builds made; .venv and downloads stay
	rm -rf .pio build/unit-tests build/sitl build/sitl-sanitized build/logs
