/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CACHE_SOURCE_DIGEST_H
#define QMAT_GRAPHS_CACHE_SOURCE_DIGEST_H

/* The hexadecimal digest of the sources that determine results (core/, io/, nodes/), written by CMake; "" with
 * -DQMAT_KEY_SOURCES=OFF, where only node versions distinguish old results. */
extern const char qmat_source_digest[];

#endif
