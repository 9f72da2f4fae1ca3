"""PlatformIO's build of a program that uses the controller: where the library is."""

from os.path import join, realpath

from SCons.Script import DefaultEnvironment

DefaultEnvironment().Append(
    LIBPATH=[realpath(join("src", "cortex-m4", "fpv4-sp-d16-hard"))],
    LIBS=["sinew_controller"],
)
