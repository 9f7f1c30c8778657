/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/descriptor/libraries.h"

#include <embree3/rtcore.h>
#include <meshoptimizer.h>
#include <png.h>
#include <stdio.h>
#include <zlib.h>

#include "nodes/mesh/subdivision_osd.h"

static void describe_cgal(char *text, size_t size) {
  snprintf(text, size, "%s", QMAT_CGAL_VERSION);
}

static void describe_draco(char *text, size_t size) {
  snprintf(text, size, "%s", QMAT_DRACO_VERSION);
}

static void describe_meshoptimizer(char *text, size_t size) {
  snprintf(text, size, "%d.%d", MESHOPTIMIZER_VERSION / 1000, MESHOPTIMIZER_VERSION % 1000 / 10);
}

static void describe_png(char *text, size_t size) {
  snprintf(text, size, "%s zlib %s", png_get_libpng_ver(NULL), zlibVersion());
}

static void describe_tinygltf(char *text, size_t size) {
  snprintf(text, size, "%s", QMAT_TINYGLTF_VERSION);
}

static void describe_opensubdiv(char *text, size_t size) {
  snprintf(text, size, "%s", qmat_opensubdiv_version());
}

/* The instruction set that Embree chooses on this processor. Embree does not report it: its rules are repeated here. */
static const char *embree_instructions(void) {
#if defined(__x86_64__)
  __builtin_cpu_init();
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi") &&
                    __builtin_cpu_supports("bmi2");
  if (avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl")) {
    return "avx512";
  }
  if (avx2) return "avx2";
  if (__builtin_cpu_supports("avx")) return "avx";
  return __builtin_cpu_supports("sse4.2") ? "sse4.2" : "sse2";
#elif defined(__aarch64__)
  return "neon";
#else
  return "other";
#endif
}

static void describe_embree(char *text, size_t size) {
  const RTCDevice device = rtcNewDevice("ignore_config_files=1,threads=1");
  const int version = device != NULL ? (int)rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION) : 0;
  if (device) rtcReleaseDevice(device);
  snprintf(text, size, "%d.%d.%d %s", version / 10000, version / 100 % 100, version % 100, embree_instructions());
}

const qmat_library qmat_library_cgal = {.name = "CGAL", .describe = describe_cgal};
const qmat_library qmat_library_draco = {.name = "Draco", .describe = describe_draco};
const qmat_library qmat_library_embree = {.name = "Embree", .describe = describe_embree};
const qmat_library qmat_library_meshoptimizer = {.name = "meshoptimizer", .describe = describe_meshoptimizer};
const qmat_library qmat_library_opensubdiv = {.name = "OpenSubdiv", .describe = describe_opensubdiv};
const qmat_library qmat_library_png = {.name = "libpng", .describe = describe_png};
const qmat_library qmat_library_tinygltf = {.name = "tinygltf", .describe = describe_tinygltf};
