/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_PAGE_CERTIFICATE_H
#define QMAT_NODES_PAGE_CERTIFICATE_H

#include "core/node.h"
#include "io/stored_medial.h"

/* The parameter `require` of the nodes that make files of medial meshes. */

typedef enum qmat_requirement { QMAT_REQUIRE_NOTHING, QMAT_REQUIRE_CERTIFIED } qmat_requirement;
extern const char *const qmat_requirement_choices[];

#define QMAT_REQUIRE_PARAM(type)                                           \
  QMAT_ENUM(type, require, qmat_requirement_choices, QMAT_REQUIRE_NOTHING, \
            "certified: the run fails, and nothing is written, where a result is not certified")

/* What a report of medial.evaluate says of the errors; NULL: nothing, and all numbers are NAN. */
qmat_stated_errors qmat_errors_of_report(const qmat_report *report);

/* Fails unless each medial mesh is certified. `medials` is a medial mesh or a list, whose failures are not certified;
 * `stated` are the errors of each. QMAT_ERROR_GEOMETRY, with the field `require`. */
qmat_status qmat_check_certified(qmat_context *context, const qmat_value *medials, const qmat_stated_errors *stated);

/* The same with the reports of medial.evaluate (NULL: none). Also QMAT_ERROR_MEMORY. */
qmat_status qmat_check_reports_certify(qmat_context *context, const qmat_value *medials, const qmat_value *reports);

#endif
