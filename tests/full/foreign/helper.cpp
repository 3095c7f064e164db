// SPDX-License-Identifier: BSD-3-Clause
bool helper_in_other_file(double x) { return x == 6; }
