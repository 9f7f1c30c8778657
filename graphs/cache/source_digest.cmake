# SPDX-License-Identifier: GPL-3.0-or-later
# cmake -DSOURCE=FOLDER -DOUTPUT=FILE.c -DENABLED=ON -P source_digest.cmake
# Writes qmat_source_digest, the SHA-256 of the names and bytes of all sources that determine results.
set(digest "")
if(ENABLED)
  file(GLOB_RECURSE sources RELATIVE ${SOURCE} ${SOURCE}/core/*.[ch] ${SOURCE}/io/*.[ch] ${SOURCE}/io/*.cpp ${SOURCE}/nodes/*.[ch]
    ${SOURCE}/nodes/*.cpp ${SOURCE}/io/page/* ${SOURCE}/examples/readers/qmat_reader.mjs)
  list(SORT sources)
  set(list "")
  foreach(source IN LISTS sources)
    file(SHA256 ${SOURCE}/${source} one)
    string(APPEND list "${one} ${source}\n")
  endforeach()
  string(SHA256 digest "${list}")
endif()
file(CONFIGURE OUTPUT ${OUTPUT} @ONLY CONTENT [[
/* Written by source_digest.cmake. */
#include "graphs/cache/source_digest.h"
const char qmat_source_digest[] = "@digest@";
]])
file(TOUCH ${OUTPUT})
