/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/usd/usdc_types.h"

const qmat_usdc_plain_type qmat_usdc_plain_types[QMAT_USDC_PLAIN_TYPES] = {
    [1] = {QMAT_USD_BOOL, 1, 0, false},
    [2] = {QMAT_USD_UCHAR, 1, 0, false},
    [3] = {QMAT_USD_INT, 1, 0, false},
    [4] = {QMAT_USD_UINT, 1, 0, false},
    [5] = {QMAT_USD_INT64, 1, 0, false},
    [6] = {QMAT_USD_UINT64, 1, 0, false},
    [7] = {QMAT_USD_HALF, 1, 0, false},
    [8] = {QMAT_USD_FLOAT, 1, 0, false},
    [9] = {QMAT_USD_DOUBLE, 1, 0, false},
    [10] = {QMAT_USD_STRING, 1, 0, false},
    [11] = {QMAT_USD_TOKEN, 1, 0, false},
    [12] = {QMAT_USD_ASSET, 1, 0, false},
    [13] = {QMAT_USD_DOUBLE, 4, 2, false},
    [14] = {QMAT_USD_DOUBLE, 9, 3, false},
    [15] = {QMAT_USD_DOUBLE, 16, 4, false},
    [16] = {QMAT_USD_DOUBLE, 4, 0, true},
    [17] = {QMAT_USD_FLOAT, 4, 0, true},
    [18] = {QMAT_USD_HALF, 4, 0, true},
    [19] = {QMAT_USD_DOUBLE, 2, 0, false},
    [20] = {QMAT_USD_FLOAT, 2, 0, false},
    [21] = {QMAT_USD_HALF, 2, 0, false},
    [22] = {QMAT_USD_INT, 2, 0, false},
    [23] = {QMAT_USD_DOUBLE, 3, 0, false},
    [24] = {QMAT_USD_FLOAT, 3, 0, false},
    [25] = {QMAT_USD_HALF, 3, 0, false},
    [26] = {QMAT_USD_INT, 3, 0, false},
    [27] = {QMAT_USD_DOUBLE, 4, 0, false},
    [28] = {QMAT_USD_FLOAT, 4, 0, false},
    [29] = {QMAT_USD_HALF, 4, 0, false},
    [30] = {QMAT_USD_INT, 4, 0, false},
    [QMAT_USDC_TIME_CODE] = {QMAT_USD_TIMECODE, 1, 0, false},
};

const uint8_t qmat_usdc_component_bytes[QMAT_USD_TYPE_COUNT] = {
    [QMAT_USD_BOOL] = 1,   [QMAT_USD_UCHAR] = 1, [QMAT_USD_INT] = 4,   [QMAT_USD_UINT] = 4,   [QMAT_USD_INT64] = 8,
    [QMAT_USD_UINT64] = 8, [QMAT_USD_HALF] = 2,  [QMAT_USD_FLOAT] = 4, [QMAT_USD_DOUBLE] = 8, [QMAT_USD_TIMECODE] = 8,
    [QMAT_USD_STRING] = 4, [QMAT_USD_TOKEN] = 4, [QMAT_USD_ASSET] = 4, [QMAT_USD_PATH] = 4,
};

const qmat_usdc_list qmat_usdc_lists[QMAT_USD_EDIT_COUNT] = {{1, QMAT_USD_EXPLICIT},  {2, QMAT_USD_ADDED},
                                                             {5, QMAT_USD_PREPENDED}, {6, QMAT_USD_APPENDED},
                                                             {3, QMAT_USD_DELETED},   {4, QMAT_USD_ORDERED}};
