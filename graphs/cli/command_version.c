/* SPDX-License-Identifier: GPL-3.0-or-later */
#include <jansson.h>
#include <openssl/crypto.h>
#include <stdio.h>
#include <yaml.h>

#include "graphs/cli/command.h"
#include "nodes/mesh/subdivision_osd.h"

/* Results depend on the libraries, so bug reports need their versions. Libraries without a version function have the
 * version that the program was built with. */
static qmat_status run(qmat_context *context, qmat_invocation *invocation) {
  (void)context;
  printf("qmat %s\n", QMAT_VERSION);
  if (!qmat_invocation_value(invocation, "verbose")) return QMAT_OK;
  printf("CGAL %s\nEmbree %s\nDraco %s\nOpenSubdiv %s\njansson %s\nlibyaml %s\n%s\ncompiler %s\n", QMAT_CGAL_VERSION,
         QMAT_EMBREE_VERSION, QMAT_DRACO_VERSION, qmat_opensubdiv_version(), jansson_version_str(),
         yaml_get_version_string(), OpenSSL_version(OPENSSL_VERSION), __VERSION__);
  return QMAT_OK;
}

static const qmat_option options[] = {
    {"verbose", 'v', NULL, "Also print the versions of the libraries"},
    {0},
};

const qmat_command qmat_command_version = {
    .name = "version",
    .arguments = "",
    .summary = "Print the version",
    .doc = "Prints the version of qmat.",
    .options = options,
    .run = run,
};
