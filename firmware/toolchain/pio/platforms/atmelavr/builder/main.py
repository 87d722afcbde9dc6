"""Compile, link, size and upload with gcc-avr and avrdude.

Commands and numbers follow the recipes of Debian's arduino-core-avr
(platform.txt, boards.txt).
"""

from SCons.Script import COMMAND_LINE_TARGETS, AlwaysBuild, Default, DefaultEnvironment

env = DefaultEnvironment()
board = env.BoardConfig()
chip = f"-mmcu={board.get('build.mcu')}"
sections = ["-ffunction-sections", "-fdata-sections"]

env.Replace(
    CC="avr-gcc",
    CXX="avr-g++",
    AS="avr-gcc",
    # The plain avr-ar does not see the symbols of link-time-optimised objects.
    AR="avr-gcc-ar",
    RANLIB="avr-gcc-ranlib",
    OBJCOPY="avr-objcopy",
    SIZETOOL="avr-size",
    SIZECHECKCMD="$SIZETOOL -A -d $SOURCES",
    SIZEPROGREGEXP=r"^\.(?:text|data)\s+(\d+)",
    SIZEDATAREGEXP=r"^\.(?:data|bss|noinit)\s+(\d+)",
    PROGNAME="firmware",
    PROGSUFFIX=".elf",
    ASFLAGS=[chip, "-x", "assembler-with-cpp"],
    CCFLAGS=[chip, "-Os", "-gstabs", "-flto", *sections],
    CXXFLAGS=["-fno-exceptions", "-fno-threadsafe-statics"],
    CPPDEFINES=[("F_CPU", board.get("build.f_cpu"))],
    LINKFLAGS=[chip, "-Os", "-gstabs", "-flto", "-fuse-linker-plugin", "-Wl,--gc-sections"],
)

elf = env.BuildProgram()
image = env.Command(
    "$BUILD_DIR/${PROGNAME}.hex",
    elf,
    env.VerboseAction("$OBJCOPY -O ihex -R .eeprom $SOURCE $TARGET", "Building $TARGET"),
)
AlwaysBuild(env.Alias("size", elf, env.VerboseAction("$SIZECHECKCMD", "Size of $SOURCE")))

upload_speed = env.subst("$UPLOAD_SPEED") or str(board.get("upload.speed"))
upload_protocol = env.subst("$UPLOAD_PROTOCOL") or board.get("upload.protocol")
env.Replace(
    UPLOADER="avrdude",
    UPLOADERFLAGS=["-p", board.get("build.mcu"), "-c", upload_protocol, "-b", upload_speed, "-D"],
    UPLOADCMD='$UPLOADER $UPLOADERFLAGS -P "$UPLOAD_PORT" -U flash:w:$SOURCES:i',
)
source = [] if "nobuild" in COMMAND_LINE_TARGETS else image
env.AddPlatformTarget(
    "upload",
    source or "$BUILD_DIR/${PROGNAME}.hex",
    [
        env.VerboseAction(env.AutodetectUploadPort, "Looking for the upload port"),
        env.VerboseAction("$UPLOADCMD", "Uploading $SOURCE"),
    ],
    "Upload",
)

Default([image])
