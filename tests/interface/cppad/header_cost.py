#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Fails if a program of 15 lines takes more than 0.3 of the time to compile that it takes with CppAD's headers.

Without optimisation it takes 0.23 on a machine that does nothing else, and up to 0.26 beside other work.

    header_cost.py COMPILER OUR_INCLUDE CPPAD_INCLUDE
"""
import pathlib
import resource
import subprocess
import sys
import tempfile

PROGRAM = """#include <vector>
int main() {
  std::vector<CppAD::AD<double>> ax{3.0, 0.5}, ay(2);
  CppAD::Independent(ax);
  ay[0] = pow(ax[0], 2.0) * sin(ax[1]) + 1.0;
  ay[1] = exp(ax[0] - ax[1]) / (1.0 + ax[1] * ax[1]);
  CppAD::ADFun<double> f(ax, ay);
  f.optimize();
  std::vector<double> x{2.0, 0.25}, w{1.0, 2.0};
  std::vector<double> y = f.Forward(0, x), J = f.Jacobian(x), H = f.Hessian(x, w), r = f.Reverse(1, w);
  std::cout << y[0] << " " << J[1] << " " << H[3] << " " << r[0] << "\\n";
}
"""
OURS = '#include <dyntape/interface/cppad/cppad.h>\n'
THEIRS = '#include <cppad/cppad.hpp>\n'


def seconds(compiler, level, include, head, folder):
    """Of the processor, the least of five."""
    source = folder / 'program.cpp'
    source.write_text(head + PROGRAM)
    taken = []
    for _ in range(5):
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        subprocess.run([compiler, '-std=c++20', level, '-I', include, '-c', source, '-o', folder / 'program.o'], check=True)
        taken.append(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before)
    return min(taken)


def main():
    compiler, ours, theirs = sys.argv[1:]
    dear = False
    with tempfile.TemporaryDirectory() as folder:
        for level in ('-O0', '-O2'):
            mine = seconds(compiler, level, ours, OURS, pathlib.Path(folder))
            other = seconds(compiler, level, theirs, THEIRS, pathlib.Path(folder))
            print(f'{level}: {mine:.2f} s, with CppAD {other:.2f} s: {mine / other:.2f}')
            dear = dear or mine > 0.3 * other
    sys.exit(dear)


main()
