// slewctl: the command line of slewd.
#include <exception>
#include <iostream>

#include "client/slewctl/commands.hpp"
#include "client/slewctl/connection.hpp"

namespace slew::ctl {
namespace {

int dispatch(const Options& options) {
  switch (options.command) {
    case Command::run:
      return run(options);
    case Command::submit:
      return submit(options);
    case Command::result:
      return result(options);
    case Command::show:
      return show(options);
    case Command::list:
    case Command::history:
      return list(options);
    case Command::series:
      return series(options);
    case Command::export_series:
      return export_series(options);
    case Command::plot:
      return plot(options);
    case Command::watch:
      return watch(options);
    case Command::cancel:
    case Command::pause:
    case Command::resume:
    case Command::step:
    case Command::rate:
      return control(options);
    case Command::presets:
      return presets(options);
    case Command::schema:
      return schema(options);
    case Command::validate:
      return validate(options);
    case Command::describe:
      return describe(options);
    case Command::model:
      return model(options);
    case Command::plan:
      return plan(options);
    case Command::compare:
      return compare(options);
    case Command::server:
      return server(options);
    case Command::doctor:
      return doctor(options);
  }
  return kRefused;
}

}  // namespace
}  // namespace slew::ctl

int main(int argc, char** argv) {
  slew::ctl::Options options;
  if (const auto code = slew::ctl::parse_command_line(argc, argv, options)) return *code;
  try {
    return slew::ctl::dispatch(options);
  } catch (const slew::ctl::Stop& stop) {
    std::cerr << "slewctl: " << stop.sentence << "\n";
    return stop.code;
  } catch (const std::exception& error) {
    std::cerr << "slewctl: " << error.what() << "\n";
    return slew::ctl::kRunFailed;
  }
}
