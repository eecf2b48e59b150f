#!/usr/bin/env bash
# The C and C++ package as its users have it: built by CMake and installed, found by CMake and by pkg-config,
# the example run, the tests passed as a package and as a folder of one's own project, the header compiled by
# every compiler that is here. OMNISTEP_COMMAND: an `omnistep` that is built already; unset: it is built.
set -euo pipefail
cd "$(dirname "$0")/.."
missing=()
for tool in cmake pkg-config; do
    command -v $tool >/dev/null || missing+=("$tool (apt install $tool)")
done
echo '#include <array>' | arm-none-eabi-g++ -x c++ -fsyntax-only - 2>/dev/null ||
    missing+=("C++ for arm-none-eabi (apt install gcc-arm-none-eabi libstdc++-arm-none-eabi-newlib)")
[ ${#missing[@]} = 0 ] || { printf 'missing: %s\n' "${missing[@]}" >&2; exit 1; }
# What is looked at is what is built here: no package of this computer, no options of a shell.
unset CMAKE_PREFIX_PATH PKG_CONFIG_PATH CXXFLAGS CFLAGS LDFLAGS CARGO_BUILD_TARGET
if [ -z "${OMNISTEP_COMMAND:-}" ]; then
    cargo build --locked --quiet --release --bin omnistep
    OMNISTEP_COMMAND=$(realpath "${CARGO_TARGET_DIR:-target}/release/omnistep")
fi
cxx=${CXX:-c++} source=$PWD/firmware/c work=$PWD/firmware/target/cpp
mkdir -p "$work"
quietly() { "$@" >"$work/said" 2>&1 || { cat "$work/said" >&2; exit 1; }; }
rm -rf "$work/prefix" "$work/moved" "$work/example" "$work/tests" "$work/tests_from_source"

# Installed, and then moved: nothing in the package knows where it was.
quietly cmake -S "$source" -B "$work/build" -DOMNISTEP_TARGET_DIR="$PWD/firmware/target"
quietly cmake --build "$work/build"
quietly cmake --install "$work/build" --prefix "$work/moved"
mv "$work/moved" "$work/prefix"
if grep -r --include='*.cmake' --include='*.pc' -F "$PWD" "$work/prefix"; then
    echo "the installed package names a folder of this computer" >&2
    exit 1
fi

# The example, as docs/cpp.md shows it: by CMake.
warnings="-Wall -Wextra -Wpedantic -Werror"
quietly cmake -S "$source/example/cpp" -B "$work/example" -DCMAKE_PREFIX_PATH="$work/prefix" \
    -DOMNISTEP_COMMAND="$OMNISTEP_COMMAND" -DCMAKE_CXX_FLAGS="$warnings"
quietly cmake --build "$work/example"
"$work/example/base" | tee "$work/example/says"
while IFS= read -r line; do
    grep -qxF -- "$line" docs/cpp.md || { echo "docs/cpp.md does not have this line of the example: $line" >&2; exit 1; }
done <"$work/example/says"
# By pkg-config; the library alone suffices, for C too, whose compiler links no library of C++.
export PKG_CONFIG_PATH=$work/prefix/lib/pkgconfig
"$OMNISTEP_COMMAND" export "$source/example/cpp/base.toml" --format c >"$work/example/constants.h"
# shellcheck disable=SC2046,SC2086 # words of options
"$cxx" -std=c++17 $warnings -I"$work/example" "$source/example/cpp/main.cpp" $(pkg-config --cflags --libs omnistep) -o "$work/example/by_pkg_config"
"$work/example/by_pkg_config" | diff "$work/example/says" -
echo 'bool plugin_c(void); int main(void) { return plugin_c() ? 0 : 1; }' >"$work/example/main.c"
# shellcheck disable=SC2046,SC2086
"${CC:-cc}" -std=c11 $warnings -I"$work/example" -include stdbool.h "$work/example/main.c" "$source/tests/plugin_c.c" \
    $(pkg-config --cflags --libs --static omnistep) -o "$work/example/in_c"
"$work/example/in_c"
echo "the example built by CMake and by pkg-config says the same; C links the library alone"
# A library, and constants, of another version than the header are rejected.
mkdir -p "$work/other"
sed "s/_init_[0-9_]*\$/_init_9_9_9/" "$source/include/omnistep.h" >"$work/other/omnistep.h"
# shellcheck disable=SC2046,SC2086
if "${CC:-cc}" -std=c11 -I"$work/other" -I"$work/example" -include stdbool.h "$work/example/main.c" "$source/tests/plugin_c.c" \
    $(pkg-config --libs --static omnistep) -o "$work/other/in_c" >"$work/said" 2>&1; then
    echo "a library of another version than the header was linked" >&2
    exit 1
fi
grep -q "omni7_init_9_9_9" "$work/said"
sed 's/^#define OMNISTEP_VERSION_NUMBER .*/#define OMNISTEP_VERSION_NUMBER 9009009/' "$source/include/omnistep.h" >"$work/other/omnistep.h"
if "${CC:-cc}" -std=c11 -I"$work/other" -fsyntax-only "$work/example/constants.h" >"$work/said" 2>&1; then
    echo "constants of another version than the header were compiled" >&2
    exit 1
fi
grep -q "constants.h is of omnistep $(pkg-config --modversion omnistep), omnistep.h is not" "$work/said"
echo "a library and constants of another version are refused"

# The tests, of what is installed and as a folder of a project.
tests() { # where, options
    quietly cmake -S "$source/tests" -B "$work/$1" -DOMNISTEP_COMMAND="$OMNISTEP_COMMAND" "${@:2}"
    quietly cmake --build "$work/$1"
    quietly ctest --test-dir "$work/$1" --output-on-failure --no-tests=error
    grep "tests passed" "$work/said"
}
tests tests -DCMAKE_PREFIX_PATH="$work/prefix"
tests tests_from_source -DOMNISTEP_SOURCE="$source" -DOMNISTEP_TARGET_DIR="$PWD/firmware/target"
# Another version is rejected before anything is compiled.
mkdir -p "$work/version"
version=$(pkg-config --modversion omnistep)
IFS=. read -r major minor _ <<<"$version"
other=$major.$((minor + 1))
printf 'cmake_minimum_required(VERSION 3.22)\nproject(version LANGUAGES C)\nfind_package(omnistep %s REQUIRED)\n' "$other" >"$work/version/CMakeLists.txt"
if cmake -S "$work/version" -B "$work/version/build" -DCMAKE_PREFIX_PATH="$work/prefix" >"$work/said" 2>&1; then
    echo "find_package(omnistep $other) took version $version" >&2
    exit 1
fi
grep -qF "compatible with requested version \"$other\"" "$work/said"

# The header by every compiler here, and for a Cortex-M without exceptions and RTTI.
for compiler in g++ clang++ "$cxx"; do
    command -v "$compiler" >/dev/null || { echo "no $compiler here: not tried"; continue; }
    for standard in 17 20; do
        # shellcheck disable=SC2086
        "$compiler" -std=c++$standard $warnings -Wshadow -Wconversion -I"$source/include" -I"$work/example" -fsyntax-only -x c++ "$source/tests/plugin_other.cpp"
    done
    echo "omnistep.hpp and constants.h: no warning of $("$compiler" --version | head -1)"
done
# shellcheck disable=SC2086
arm-none-eabi-g++ -std=c++17 -mcpu=cortex-m4 -mthumb -ffreestanding -fno-exceptions -fno-rtti -O2 $warnings -I"$source/include" \
    -I"$work/example" -c "$source/tests/plugin_other.cpp" -o "$work/on_arm.o"
foreign=$(arm-none-eabi-nm -u "$work/on_arm.o" | awk '$2 !~ /^(omni|mem(cpy|set)$)/ { print $2 }')
[ -z "$foreign" ] || { echo "on a Cortex-M the header needs more than the C library: $foreign" >&2; exit 1; }
echo "omnistep.hpp for a Cortex-M4: without exceptions, RTTI and a library of C++"
