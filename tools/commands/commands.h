// SPDX-License-Identifier: Apache-2.0
// The sub-commands of `farpoint`. Each add_*() declares one on the command line and, if it was given, sets
// `action`, which does the work and returns the exit status.
#pragma once

#include <CLI/App.hpp>
#include <functional>

namespace farpoint::tools {

using Action = std::function<int()>;

void add_import_command(CLI::App* app, Action* action);
void add_export_command(CLI::App* app, Action* action);
void add_dbc_command(CLI::App* app, Action* action);
void add_evaluate_command(CLI::App* app, Action* action);
void add_bugreport_command(CLI::App* app, Action* action);
void add_bench_command(CLI::App* app, Action* action);
void add_ctl_command(CLI::App* app, Action* action);
void add_top_command(CLI::App* app, Action* action);
void add_report_command(CLI::App* app, Action* action);
void add_spy_command(CLI::App* app, Action* action);
void add_simulate_command(CLI::App* app, Action* action);
void add_mask_command(CLI::App* app, Action* action);

// The whole program: parses, runs, and reports every failure by one line on standard error and an exit
// status.
int run_farpoint(int argc, const char* const* argv);

}  // namespace farpoint::tools
