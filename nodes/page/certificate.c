/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "nodes/page/certificate.h"

#include <math.h>

#include "core/text.h"
#include "nodes/page/shown.h"

const char *const qmat_requirement_choices[] = {
    [QMAT_REQUIRE_NOTHING] = "none", [QMAT_REQUIRE_CERTIFIED] = "certified", NULL};

static qmat_certificate certificate_of(const qmat_report *report) {
  const json_t *certified = report ? json_object_get(report->root, "certified") : NULL;
  if (!json_is_boolean(certified)) return QMAT_CERTIFICATE_UNKNOWN;
  return json_is_true(certified) ? QMAT_CERTIFICATE_YES : QMAT_CERTIFICATE_NO;
}

qmat_stated_errors qmat_errors_of_report(const qmat_report *report) {
  return (qmat_stated_errors){.diagonal = qmat_shown_number(report, "diagonal"),
                              .meters_per_unit = qmat_shown_number(report, "meters_per_unit"),
                              .epsilon = qmat_shown_number(report, "epsilon"),
                              .error_out = qmat_shown_number(report, "surface_to_envelope"),
                              .error_in = qmat_shown_number(report, "envelope_to_surface"),
                              .certified = certificate_of(report)};
}

qmat_status qmat_check_certified(qmat_context *context, const qmat_value *medials, const qmat_stated_errors *stated) {
  for (size_t i = 0; i < qmat_value_count(medials); i++) {
    const char *failure = qmat_value_failure(qmat_value_at(medials, i));
    if (!failure && stated[i].certified == QMAT_CERTIFICATE_YES) continue;
    char out[48], in[48], epsilon[48];
    qmat_format_bound(stated[i].error_out, out);
    qmat_format_bound(stated[i].error_in, in);
    qmat_format_bound(stated[i].epsilon, epsilon);
    if (failure)
      qmat_fail(context, QMAT_ERROR_GEOMETRY, "not certified: %s", failure);
    else if (stated[i].certified == QMAT_CERTIFICATE_UNKNOWN)
      qmat_fail(context, QMAT_ERROR_GEOMETRY, "not certified: no report says how large the errors are");
    else if (fmax(stated[i].error_out, stated[i].error_in) <= stated[i].epsilon)
      qmat_fail(context, QMAT_ERROR_GEOMETRY,
                "not certified: the errors are estimates, since the surface is not closed");
    else
      qmat_fail(context, QMAT_ERROR_GEOMETRY, "not certified: the errors are %s and %s of the diagonal, and epsilon %s",
                out, in, epsilon);
    if (medials->type == QMAT_LIST) qmat_fail_within(context, ((const qmat_list *)medials)->names[i]);
    qmat_fail_field(context, "require");
    return qmat_fail_hint(context, "a larger epsilon, or qmat mat: --require none");
  }
  return QMAT_OK;
}

qmat_status qmat_check_reports_certify(qmat_context *context, const qmat_value *medials, const qmat_value *reports) {
  const size_t count = qmat_value_count(medials);
  qmat_stated_errors *stated = qmat_arena_alloc(&context->arena, count, sizeof *stated);
  if (!stated) return qmat_fail_memory(context, "the errors");
  for (size_t i = 0; i < count; i++)
    stated[i] = qmat_errors_of_report((const qmat_report *)qmat_shown_given(reports, i));
  return qmat_check_certified(context, medials, stated);
}
