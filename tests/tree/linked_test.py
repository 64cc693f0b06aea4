#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: linked_test.py BUILD_FOLDER

Holds the libraries that farpointd, its modules and farpoint load, with all that those load in turn, to a list.
Farpoint is under Apache-2.0: no program links GPL code. The one exception is the module with Ceres, which farpointd
loads only where the configuration asks for it.
"""

import pathlib
import re
import subprocess
import sys

# Stems of names: libX.so.N and libX-1.2.so are both X.
SYSTEM = {"linux-vdso", "ld-linux-x86-64", "ld-linux-aarch64", "c", "m", "dl", "rt", "pthread", "gcc_s", "stdc++",
          "atomic"}
# What LCM (glib) and libsystemd load.
LCM = {"lcm", "glib-2.0", "pcre2-8", "pcre"}
SYSTEMD = {"systemd", "cap", "gcrypt", "gpg-error", "lzma", "zstd", "lz4"}
DAEMON = SYSTEM | LCM | SYSTEMD | {"hwy", "png16", "jpeg", "z", "spdlog", "fmt", "yaml-cpp"}
# The yardstick of 'farpoint bench' is OpenCV's ORB; Debian's core brings OpenGL, X11, TBB and LAPACK.
OPENCV = {"opencv_core", "opencv_features2d", "opencv_flann", "opencv_imgproc", "tbb", "GLX", "GLdispatch", "X11", "xcb",
          "Xau", "Xdmcp", "bsd", "md", "lapack", "blas", "f77blas", "cblas", "atlas", "openblas", "openblasp", "gfortran",
          "quadmath", "gomp"}
# Chunks of ROS bags, and bags in SQLite.
BAGS = {"bz2", "lz4", "zstd", "sqlite3"}
LIBCAMERA = {"camera", "camera-base", "gnutls", "udev", "yaml-0", "p11-kit", "idn2", "unistring", "tasn1", "nettle",
             "hogweed", "gmp", "ffi", "lttng-ust", "lttng-ust-common", "lttng-ust-tracepoint", "numa",
             "boost_filesystem", "dw", "elf", "bz2", "unwind"}
CERES = {"cholmod", "cxsparse", "glog", "gflags", "unwind", "lapack", "blas", "f77blas", "cblas", "atlas", "openblas",
         "openblasp", "gfortran", "quadmath", "gomp", "amd", "camd", "colamd", "ccolamd", "metis", "suitesparseconfig",
         "spqr", "tbb", "hwy"}

# Libraries under the GPL that Debian's packages bring along, with where they come from.
GPL = {"cholmod": "Ceres", "spqr": "Ceres", "umfpack": "SuiteSparse", "gdal": "opencv_imgcodecs",
       "poppler": "GDAL, by opencv_imgcodecs", "opencv_imgcodecs": "GDAL and poppler behind it", "avcodec": "FFmpeg",
       "avformat": "FFmpeg", "x264": "FFmpeg", "x265": "FFmpeg", "fftw3": "FFTW", "gsl": "GSL", "readline": "readline"}

# File in the build folder: what it may load, what of that may be GPL, whether it must be there.
FILES = {
    "bin/farpointd": (DAEMON, set(), True),
    "bin/farpoint": (DAEMON | OPENCV | BAGS, set(), True),
    "lib/farpoint/farpoint_libcamera.so": (DAEMON | LIBCAMERA, set(), False),
    "lib/farpoint/farpoint_ceres.so": (SYSTEM | LCM | CERES | {"lzma", "z"}, {"cholmod", "spqr"}, True),
}


def stem(name: str) -> str:
    """libglib-2.0.so.0 -> glib-2.0; /lib64/ld-linux-x86-64.so.2 -> ld-linux-x86-64."""
    name = name.rsplit("/", 1)[-1].split(".so")[0]
    return re.sub(r"^lib", "", name)


def without_version(name: str) -> str:
    """spdlog of libspdlog-1.10.so; names that end in a version on purpose (glib-2.0) are listed with it."""
    return re.sub(r"-[\d.]+$", "", name)


def problems(names, allowed, gpl_allowed):
    """One line for each library that may not be there. Every name as ldd prints it."""
    for name in names:
        short = stem(name)
        found = short if short in allowed or short in GPL else without_version(short)
        if found in GPL and found not in gpl_allowed:
            yield f"{name}: under the GPL (by {GPL[found]})"
        elif found not in allowed:
            yield f"{name}: not in the list of tests/tree/linked_test.py; add it there where its licence allows it"


def libraries(path):
    done = subprocess.run(["ldd", str(path)], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"ldd {path}: {done.stderr.strip()}")
    names = [line.split()[0] for line in done.stdout.splitlines() if line.strip()]
    missing = [line.strip() for line in done.stdout.splitlines() if "not found" in line]
    return names, missing


def check(build):
    for name, (allowed, gpl_allowed, required) in FILES.items():
        path = build / name
        if not path.exists():
            if required:
                yield f"{name}: not built"
            continue
        names, missing = libraries(path)
        yield from (f"{name}: {line}" for line in missing)
        yield from (f"{name}: {line}" for line in problems(names, allowed, gpl_allowed))


def self_check():
    """The check finds what it is for."""
    assert not list(problems(["linux-vdso.so.1", "libglib-2.0.so.0", "libspdlog.so.1.10", "libpng16.so.16"], DAEMON, set()))
    for name in ("libcholmod.so.3", "libgdal.so.32", "libpoppler.so.126", "libopencv_imgcodecs.so.406"):
        assert "GPL" in list(problems([name], DAEMON | OPENCV, set()))[0], name
    assert "not in the list" in list(problems(["libsomething.so.1"], DAEMON, set()))[0]
    assert not list(problems(["libcholmod.so.3"], CERES, {"cholmod"}))


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    self_check()
    found = list(check(pathlib.Path(sys.argv[1])))
    for line in found:
        print(line)
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
