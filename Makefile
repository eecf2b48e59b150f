# Each target is one line that calls a script; .ci/run calls the same.
.PHONY: run test test-full bench generated lint coverage embedded aarch64 wasm instructions firmware viewers web ros2 docs playground supply-chain attack attack-long package dist archives semver study climb-charts cpp workflows

run:            ## the paper's experiment: every policy over the step
	cargo run --release -- compare step

test:           ## every Rust and Python test; makes its own virtual environment in .venv
	scripts/test.sh

test-full:      ## test, then the long checks: ensembles and benchmarks
	scripts/test-full.sh

bench:          ## ratios of control and simulation cost, and of what Python pays
	scripts/bench.sh

generated:      ## writes every committed file that is made from others: schemas, C header, tables, docstrings, player
	scripts/generated.sh

lint:           ## formatting and lints of Rust and Python
	scripts/lint.sh

study:          ## traction control against plain loops: runs, gates, docs/study.md and its pictures; some forty minutes
	scripts/study.sh

climb-charts:   ## the climb chart of every built-in vehicle and its checks; some twenty minutes
	scripts/climb-charts.sh

coverage:       ## line coverage of omni-core by its own tests, at least 95 %
	scripts/coverage.sh

firmware:       ## images, budgets, C example and processor in the loop, all in QEMU
	scripts/firmware.sh

cpp:            ## the C++ package: installed, found by CMake and pkg-config, its example and tests; needs cmake
	scripts/cpp.sh

viewers:        ## logs in foreign readers, a live run, a report in headless Chromium; needs node and chromium
	scripts/viewers.sh

web:            ## the player of report and playground, bundled with three.js into the Python package; needs node
	scripts/web.sh

ros2:           ## run --ros2 with Cyclone DDS and Fast DDS at the other end; says what it skips; for all of it libfastrtps-dev, nftables
	scripts/ros2.sh

embedded:       ## omni-core for Cortex-M4F, Cortex-M0 and RISC-V
	scripts/embedded.sh

aarch64:        ## the simulation on 64-bit Arm in QEMU, bit-identical to the native one
	scripts/aarch64.sh

wasm:           ## the simulation in WebAssembly, bit-identical to the native one; needs node
	scripts/wasm.sh

instructions:   ## instructions of a control step, at most 3.1 times those of as many bare PID loops; of a physics step
	scripts/instructions.sh

docs:           ## the documentation site in out/site, warnings as errors
	scripts/docs.sh

playground:     ## the simulation in the browser, a page in out/playground; needs node, npm and a toolchain for WebAssembly
	scripts/playground.sh

supply-chain:   ## licences, sources and duplicates of Rust dependencies, known vulnerabilities where reachable
	scripts/supply-chain.sh

package:        ## what would be published of each crate, listed; nothing is uploaded
	scripts/package.sh

dist:           ## wheels and static programs for Linux on x86_64 and aarch64, compared byte by byte; says what it skips
	scripts/dist.sh

archives:       ## libomnistep.a for eight kinds of processors, packed for Arduino and others, in out/archives; tried in QEMU
	scripts/archives.sh

workflows:      ## lints of what only GitHub reads, and CITATION.cff; says what it skips
	scripts/workflows.sh

semver:         ## public items of the crates, compared with the last release or the commit in BASELINE
	scripts/semver.sh

attack:         ## mutants, bombs, random bits, lies, live clients, loss, leaks, stops: under four minutes after `make test`
	scripts/attack.sh

attack-long:    ## the same ten to twenty times from another seed, then the fuzzer, five minutes a target
	scripts/attack.sh --long
