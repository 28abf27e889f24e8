// One function per command; each returns an exit code.
#pragma once

#include "client/slewctl/options.hpp"

namespace slew::ctl {

int run(const Options& options);
int submit(const Options& options);

int result(const Options& options);
int show(const Options& options);
int list(const Options& options);
int series(const Options& options);
int export_series(const Options& options);
int plot(const Options& options);

int watch(const Options& options);
int control(const Options& options);

int presets(const Options& options);
int schema(const Options& options);
int validate(const Options& options);
int describe(const Options& options);
int model(const Options& options);
int plan(const Options& options);
int compare(const Options& options);

int server(const Options& options);
int doctor(const Options& options);

}  // namespace slew::ctl
