/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_CPU_TIME_H
#define QMAT_TESTS_CPU_TIME_H

#include <time.h>

/* The processor time of this process so far, in seconds. */
static inline double cpu_time(void) {
  struct timespec time;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

#endif
