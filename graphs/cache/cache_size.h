/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CACHE_CACHE_SIZE_H
#define QMAT_GRAPHS_CACHE_CACHE_SIZE_H

#include "graphs/cache/cache_files.h"

/* How much a cache holds, without a listing: the file `size` in its folder. Its first line is the size of all records
 * and blobs at the last listing, 20 digits. Each byte after it stands for 64 KiB that may have been stored since, so
 * the length of the file is the count.
 *
 * A process appends bytes as soon as it has stored what they stand for, so that a killed one has counted it too. It
 * takes no lock. A file that is missing or malformed says nothing, and the next sweep lists the folder and writes it
 * anew. A listing may leave out 64 KiB of each running process, and over a network file system two appends may become
 * one: the next listing corrects that, after an eighth of the limit at the latest. */

/* Counts `bytes` that were stored. Costs three system calls for each 64 KiB, none in between. */
void qmat_cache_count(qmat_cache *cache, uint64_t bytes);

/* Whether the folder has to be listed: it may be above the size, or how much it holds is not known. */
bool qmat_cache_may_be_full(const qmat_cache *cache);

/* The length of the file; 0: there is none. It is taken before a listing. */
uint64_t qmat_cache_size_length(const qmat_cache *cache);

/* Notes the size that a listing found. What was appended after the file had `length` bytes stays. An empty cache has no
 * file. */
void qmat_cache_note_size(qmat_cache *cache, uint64_t total, uint64_t length);

/* Takes the lock of sweeps, or tells that another process has it. `*file` is closed with close() if it is not negative.
 * Without a file, or where the file system has no locks, every process may sweep. */
bool qmat_cache_begin_sweep(const qmat_cache *cache, int *file);

#endif
