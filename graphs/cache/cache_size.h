/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_GRAPHS_CACHE_CACHE_SIZE_H
#define QMAT_GRAPHS_CACHE_CACHE_SIZE_H

#include "graphs/cache/cache.h"

/* How much a cache holds, without a listing: the file `size` in its folder. Its first line is the size of all records
 * and blobs at the last listing, 20 digits. Each byte after it stands for 64 KiB that may have been stored since, so
 * the length of the file is the count.
 *
 * A process appends bytes before it stores what they stand for: a killed one counts too much, never too little.
 * Appending takes no lock. A file that is missing or malformed says nothing, and the next sweep lists the folder and
 * writes it anew. Over a network file system two appends may become one; a listing corrects that after an eighth of the
 * limit at the latest. */

/* Counts `bytes` that are about to be stored. Costs three system calls for each 64 KiB, none in between. */
void qmat_cache_count(qmat_cache *cache, uint64_t bytes);

/* Whether the folder has to be listed: it may be above the size, or how much it holds is not known. */
bool qmat_cache_may_be_full(const qmat_cache *cache);

/* How many bytes stand after the first line; 0: the file says nothing. Taken before a listing. */
uint64_t qmat_cache_counted(const qmat_cache *cache);

/* Notes the size that a listing found. What was counted after `counted` stays counted. An empty cache has no file. */
void qmat_cache_note_size(qmat_cache *cache, uint64_t total, uint64_t counted);

/* Takes the lock of sweeps, or tells that another process has it. `*file` is closed with close() if it is not negative.
 * Without a file, or where the file system has no locks, every process may sweep. */
bool qmat_cache_begin_sweep(const qmat_cache *cache, int *file);

#endif
