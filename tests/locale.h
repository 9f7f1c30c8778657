/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_TESTS_LOCALE_H
#define QMAT_TESTS_LOCALE_H

#include <locale.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

/* Puts a locale with a decimal comma in force, one that is made for the moment where the system has none. Skips the
 * test when that cannot be. setlocale(LC_ALL, "C") ends it. */
static inline void locale_with_comma(void) {
  if (!setlocale(LC_ALL, "de_DE.UTF-8")) {
    char folder[] = "/tmp/qmat-locale-XXXXXX", command[128];
    assert_non_null(mkdtemp(folder));
    snprintf(command, sizeof command, "localedef -i de_DE -f UTF-8 %s/de_DE.UTF-8 >/dev/null 2>&1", folder);
    setenv("LOCPATH", folder, 1);
    const bool made = system(command) == 0 && setlocale(LC_ALL, "de_DE.UTF-8");
    unsetenv("LOCPATH");
    snprintf(command, sizeof command, "rm -r %s", folder);
    assert_int_equal(system(command), 0);
    if (!made) {
      print_message("skipped: no locale with a decimal comma can be made (Debian: apt install locales)\n");
      skip();
    }
  }
  assert_int_equal(*localeconv()->decimal_point, ',');
}

#endif
