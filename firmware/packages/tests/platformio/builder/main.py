"""A platform of PlatformIO for the test: compiles a project without a framework, for QEMU."""

from os.path import join

from SCons.Script import AlwaysBuild, Default, DefaultEnvironment

env = DefaultEnvironment()
board = env.BoardConfig()
folder, prefix = join(env.PioPlatform().get_dir(), "program"), board.get("build.prefix")
flags, startup = board.get("build.flags").split(), board.get("build.startup")
env.Replace(CC=f"{prefix}gcc", CXX=f"{prefix}g++", AR=f"{prefix}ar", RANLIB=f"{prefix}ranlib", ARFLAGS=["rcs"])
env.Replace(LINK=f"{prefix}gcc", PROGNAME="firmware", PROGSUFFIX=".elf")
# PlatformIO repeats the options of the processor, which gcc refuses for --specs.
machine = [flag for flag in flags if not flag.startswith("--specs")]
env.Append(CCFLAGS=[*machine, "-Wall", "-Wextra", "-Werror"], CPPPATH=[folder])
env.Append(LINKFLAGS=[*flags, "-nostartfiles", "-T", board.get("build.script"), "-Wl,--gc-sections,--fatal-warnings"])
env.BuildSources(join("$BUILD_DIR", "startup"), folder, [f"+<{startup}>"])
program = env.BuildProgram()
AlwaysBuild(env.Alias("nobuild", program))
Default([program])
