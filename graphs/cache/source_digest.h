/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CACHE_SOURCE_DIGEST_H
#define QMAT_GRAPHS_CACHE_SOURCE_DIGEST_H

/* The digest of the sources that results come from (core/, io/, nodes/), as hexadecimal digits, written by CMake; ""
 * when the program was configured with -DQMAT_KEY_SOURCES=OFF and only the versions of nodes tell old results apart. */
extern const char qmat_source_digest[];

#endif
