// Options of ChaN's FatFs R0.15 (80286), chosen for 8 KB of RAM; ff.h reads this file.
// Measured with avr-gcc 5.4 -Os: FATFS 560 B and FIL 34 B of RAM with FF_FS_TINY.
#pragma once

#define FFCONF_DEF 80286

// What the card needs: find, create, preallocate, truncate and delete short-named files.
#define FF_FS_READONLY 0
#define FF_FS_MINIMIZE 0
#define FF_USE_EXPAND 1  // f_expand: the flight file is contiguous

#define FF_USE_FIND 0
#define FF_USE_MKFS 0
#define FF_USE_FASTSEEK 0
#define FF_USE_CHMOD 0
#define FF_USE_LABEL 0
#define FF_USE_FORWARD 0
#define FF_USE_STRFUNC 0
#define FF_PRINT_LLI 0
#define FF_PRINT_FLOAT 0
#define FF_STRF_ENCODE 0

// Names of 8.3 in capitals: no long names, no Unicode tables in flash. Code page 932 has the
// smallest table in RAM (10 B; 437 has 128 B); the names of ours are ASCII.
#define FF_CODE_PAGE 932
#define FF_USE_LFN 0
#define FF_MAX_LFN 255
#define FF_LFN_UNICODE 0
#define FF_LFN_BUF 255
#define FF_SFN_BUF 12
#define FF_FS_RPATH 0

// One card, 512-byte sectors, below 2 TB.
#define FF_VOLUMES 1
#define FF_STR_VOLUME_ID 0
#define FF_VOLUME_STRS "SD"
#define FF_MULTI_PARTITION 0
#define FF_MIN_SS 512
#define FF_MAX_SS 512
#define FF_LBA64 0
#define FF_MIN_GPT 0x10000000
#define FF_USE_TRIM 0

#define FF_FS_TINY 1  // files share the one sector buffer of the volume
#define FF_FS_EXFAT 0

// get_fattime() answers with the date of the GPS, or with FatFs's zero of time.
#define FF_FS_NORTC 0
#define FF_NORTC_MON 1
#define FF_NORTC_MDAY 1
#define FF_NORTC_YEAR 2026

#define FF_FS_NOFSINFO 0
#define FF_FS_LOCK 0
#define FF_FS_REENTRANT 0
#define FF_FS_TIMEOUT 1000
