/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Linked into a test program, leaves of its cases those with "thread" in their names. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

__attribute__((constructor)) static void choose_cases(void) {
  cmocka_set_test_filter("*thread*");
}
