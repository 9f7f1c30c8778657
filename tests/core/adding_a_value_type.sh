#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# A new type of value is two edits: adding_a_value_type.sh SOURCE_FOLDER SCRATCH_FOLDER
# A copy of core gets the type "route" by one edit of core/value_types.h and one of core/value_table.c. The copy must
# compile, and making, checking, sealing, counting, writing, reading and freeing a route must work. The rest of the
# sources must not list value types, so that they need no edit.
set -eu
source=$1
copy=$2
mkdir -p "$copy"
rm -rf "$copy/core"
cp -R "$source/core" "$copy/core"

# Edit 1: the struct, and its line in the list.
awk '
  { print }
  /TYPE\(FILE, file\)/ { print "  TYPE(ROUTE, route)           \\" }
  /^\/\* Named counts and errors/ { described = 1 }
  described && /^} qmat_report;/ {
    print ""
    print "typedef struct qmat_route {"
    print "  qmat_value base;"
    print "  size_t stop_count;"
    print "  double *stops; /* 3 * stop_count */"
    print "  char *title;"
    print "} qmat_route;"
    described = 0
  }' "$source/core/value_types.h" >"$copy/core/value_types.h"

# Edit 2: the rows, the rules, and the entry of the table.
awk '
  /^\/\* The table\. \*\/$/ {
    print "static const qmat_value_row route_rows[] = {ARRAY(qmat_route, stops, F64, stop_count, 3),"
    print "                                            SCALAR(qmat_route, title, TEXT), END};"
    print ""
    print "static qmat_status check_route(qmat_context *context, const qmat_value *value) {"
    print "  const qmat_route *route = (const qmat_route *)value;"
    print "  return qmat_check_finite(context, route->stops, route->stop_count, 3, \"stop\", \"position\");"
    print "}"
    print ""
  }
  { print }
  /\[QMAT_FILE\] = / { print "    [QMAT_ROUTE] = {TYPE(route), {COUNT(qmat_route, stop_count, \"stops\")}}," }
' "$source/core/value_table.c" >"$copy/core/value_table.c"

cat >"$copy/route.c" <<'EOF'
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/value.h"
#include "core/value_form.h"

#define MUST(condition)                                    \
  do {                                                     \
    if (!(condition)) {                                    \
      fprintf(stderr, "line %d: %s\n", __LINE__, #condition); \
      return 1;                                            \
    }                                                      \
  } while (0)

static qmat_route *make_route(void) {
  qmat_route *route = qmat_route_new();
  route->stop_count = 2;
  route->stops = qmat_calloc(6, sizeof *route->stops);
  for (int i = 0; i < 6; i++) route->stops[i] = i;
  route->title = qmat_strdup("home");
  return route;
}

int main(void) {
  qmat_context context = {0};
  qmat_route *route = make_route();
  MUST(strcmp(qmat_value_type_name(QMAT_ROUTE), "route") == 0);

  /* Its rules are checked, and what it lacks. */
  route->stops[4] = NAN;
  MUST(qmat_value_seal(&context, &route->base) == QMAT_ERROR_GEOMETRY && context.error.element == 1);
  route->stops[4] = 4;
  MUST(qmat_value_seal(&context, &route->base) == QMAT_OK);
  qmat_route *untitled = qmat_route_new();
  MUST(qmat_value_seal(&context, &untitled->base) == QMAT_ERROR_INTERNAL);
  qmat_value_release(&untitled->base);

  /* Counts and size, alone and in a list. */
  size_t counts[QMAT_MOST_COUNTS];
  qmat_value_counts(&route->base, counts);
  MUST(counts[0] == 2 && counts[1] == 0 && strcmp(qmat_value_count_rows(QMAT_ROUTE)[0].name, "stops") == 0);
  MUST(qmat_value_bytes(&route->base) == 6 * 8 + 4);
  qmat_list *list = qmat_list_new(2);
  for (int i = 0; i < 2; i++) {
    list->items[i] = qmat_value_retain(&route->base);
    list->names[i] = qmat_strdup("r");
  }
  MUST(qmat_value_seal(&context, &list->base) == QMAT_OK && qmat_value_item_type(&list->base) == QMAT_ROUTE);
  qmat_value_counts(&list->base, counts);
  MUST(counts[0] == 4);
  qmat_value_release(&list->base);

  /* Written and read again: the same value. */
  uint8_t *bytes;
  size_t size;
  qmat_value *again;
  MUST(qmat_value_serialize(&context, &route->base, &bytes, &size) == QMAT_OK);
  MUST(qmat_value_deserialize(&context, bytes, size, NULL, &again) == QMAT_OK);
  const qmat_route *read = (const qmat_route *)again;
  MUST(again->type == QMAT_ROUTE && qmat_digest_equal(&again->digest, &route->base.digest));
  MUST(read->stop_count == 2 && read->stops[5] == 5 && strcmp(read->title, "home") == 0);
  MUST(qmat_value_deserialize(&context, bytes, size - 1, NULL, &again) == QMAT_ERROR_FORMAT);
  qmat_free(bytes);
  qmat_value_release((qmat_value *)read);
  qmat_value_release(&route->base);
  return 0;
}
EOF
cd "$copy"
${CC:-cc} -std=c17 -D_GNU_SOURCE -DQMAT_VERSION='"0"' -g -Wall -Wextra -Werror -fsanitize=address,undefined -fopenmp -I. \
  route.c core/arena.c core/context.c core/digest.c core/status.c core/text.c core/value.c core/value_check.c \
  core/value_form.c core/value_table.c -ljansson -lcrypto -lm -o route
./route

# Nothing else lists the types: no table with a row per type, no switch over them.
cd "$source"
if grep -rnE '\[QMAT_(SCENE|MESH|FIELD|SAMPLES|MEDIAL|CHAIN|REPORT|FILE)\] *=|case QMAT_(SCENE|MESH|FIELD|SAMPLES|MEDIAL|CHAIN|REPORT|FILE):' \
  core io nodes graphs --include='*.c' --include='*.h' --include='*.cpp' | grep -v '^core/value_table.c:'; then
  echo "these places list value types; they belong in core/value_table.c"
  exit 1
fi
