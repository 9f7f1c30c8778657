/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_DESCRIPTOR_MEDIAL_SUMMARY_H
#define QMAT_NODES_DESCRIPTOR_MEDIAL_SUMMARY_H

#include "core/node.h"

/* The summary of nodes whose report states both errors of a medial mesh: how many spheres describe the model, and how
 * well. A report with the flag "certified" bounds the distance of the envelope's whole boundary; without that flag it
 * bounds only how far the envelope leaves the solid. */
extern const qmat_report_summary qmat_medial_summary;

#endif
