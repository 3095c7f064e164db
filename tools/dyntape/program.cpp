// SPDX-License-Identifier: BSD-3-Clause
#include "program.h"

#include <fcntl.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <nlohmann/json.hpp>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/suggest.h>
#include <dyntape/codegen/run/threads.h>

#include "commands.h"
#include "help.h"

namespace dyntape::tools {
namespace {

// A name may be as long as its file; its beginning is enough for a message.
std::string shortened(const std::string& name) {
  constexpr std::size_t kShown = 60, kLong = 200;
  if (name.size() <= kLong) return name;
  std::size_t end = kShown;
  while ((static_cast<unsigned char>(name[end]) & 0xC0) == 0x80) --end;  // characters stay whole
  return name.substr(0, end) + "...";
}

// Names stand in quotes; what stands without may be a path, which is longer for a reason.
std::string with_short_names(const std::string& sentences) {
  constexpr std::size_t kLongestPath = 4096;
  std::string text;
  for (std::size_t begin = 0; begin < sentences.size();) {
    const char c = sentences[begin];
    if (c == ' ' || c == '\n') {
      text += sentences[begin++];
      continue;
    }
    const bool is_name = c == '"' || c == '\'';
    const std::string ends = is_name ? std::string{c, '\n'} : " \n\"";
    const std::size_t end = std::min(sentences.find_first_of(ends, begin + 1), sentences.size());
    const std::string word = sentences.substr(begin, end - begin);
    text += is_name || word.size() > kLongestPath ? shortened(word) : word;
    begin = end;
    if (is_name && end < sentences.size()) text += sentences[begin++];
  }
  return text;
}

std::vector<std::string> names_of_commands(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  return names;
}

// What nobody expects: where it looks like an option, with the nearest one of the command that was given.
std::string unexpected(const CLI::App& app) {
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().front();
  std::vector<std::string> options;
  for (const CLI::Option* option : command->get_options()) {
    if (!option->get_positional()) options.push_back(option->get_name());
  }
  const std::vector<std::string> words = app.remaining(true);
  const std::string word = words.empty() ? "" : words.front();
  const std::string what = "the command \"" + command->get_name() + "\" ";
  if (!word.starts_with("-")) return what + "does not expect the word '" + word + "'";
  const std::string name = word.substr(0, word.find('='));
  return what + "has no option '" + name + "'" + suggestion(name, options);
}

std::string wrong_words(const CLI::App* app, const CLI::Error& error) {
  const bool is_unexpected = dynamic_cast<const CLI::ExtrasError*>(&error);
  return with_short_names(one_line(is_unexpected ? unexpected(*app) : error.what())) +
         "\nRun with --help for more information.\n";
}

int failed(const std::string& sentence, int status = 1) {
  std::cerr << "dyntape: " << sentence << "\n";
  return status;
}

int failed_unexpectedly(const std::exception& e) {
  return failed(std::string("unexpected failure: ") + e.what());
}

// What was printed has arrived, or the command has not done its work.
int arrived(int status) {
  errno = 0;
  if (std::cout.flush()) return status;
  return failed(
      "the standard output cannot be written" + (errno ? std::string(": ") + std::strerror(errno) : ""),
      status ? status : 1);
}

std::string whole_name(const CLI::App& app) {
  return app.get_parent() ? app.get_parent()->get_name() + " " + app.get_name() : app.get_name();
}

// "a, b or c"
std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += (i == 0 ? "" : i + 1 == names.size() ? " or " : ", ") + names[i];
  return text;
}

// CLI11 says no more of a missing or misspelt command than that one is required.  "" if the words name one.
std::string misspelt_command(const CLI::App& app, int argc, char** argv) {
  const std::vector<std::string> names = names_of_commands(app);
  if (names.empty()) return {};
  if (argc < 2) return whole_name(app) + " needs a command; expected " + listed(names);
  if (argv[1][0] == '-') return {};
  const std::string word = argv[1];
  if (std::find(names.begin(), names.end(), word) != names.end())
    return misspelt_command(*app.get_subcommand(word), argc - 1, argv + 1);
  return "'" + word + "' is no command of " + whole_name(app) + suggestion(word, names);
}

int parse(CLI::App& app, int argc, char** argv) {
  try {
    codegen::thread_count();  // refuses a wrong DYNTAPE_THREADS, also for commands that start no threads
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) ? 2 : 0;  // 2: the command line itself is wrong
  } catch (const Failure& failure) {
    return failure.status;
  } catch (const Sentence& e) {
    return failed(with_short_names(e.what()));
  } catch (const Error& e) {
    return failed(e.what());
  } catch (const nlohmann::json::type_error& e) {
    constexpr int kNotUtf8 = 316;
    return e.id == kNotUtf8 ? failed(
                                  "a name or a path is not UTF-8, which JSON has to be; expected names in "
                                  "UTF-8 (iconv -t utf-8)")
                            : failed_unexpectedly(e);
  } catch (const std::exception& e) {
    return failed_unexpectedly(e);
  }
  return 0;
}

}  // namespace

void print_json(const nlohmann::json& report) { std::cout << report.dump(2) << "\n"; }

void open_standard_streams() {
  for (const int stream : {0, 1, 2}) {
    // The other way round, so that nothing can be read there, or written.
    if (fcntl(stream, F_GETFD) < 0 && errno == EBADF)
      (void)!open("/dev/null", stream == 0 ? O_WRONLY : O_RDONLY);
  }
}

int run(CLI::App& app, int argc, char** argv) {
  open_standard_streams();
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error with a sentence
  app.require_subcommand(1);
  app.failure_message(wrong_words);
  set_help(app);
  if (const std::string fault = misspelt_command(app, argc, argv); !fault.empty())
    return failed(with_short_names(one_line(fault)) + "\nRun with --help for more information.", 2);
  const int status = arrived(parse(app, argc, argv));
  // The end of a process waits for what the solver of an interrupted solve still computes (solvers/ipopt.h).
  if (status > 128) std::_Exit(status);
  return status;
}

}  // namespace dyntape::tools
