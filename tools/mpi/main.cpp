// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape-mpi: `dyntape sweep` by several processes.  mpirun -n 7 dyntape sweep ... comes here by itself.
//
// Rank 0 reads, writes, prints and computes; the others load the functions once it has them, compute what it hands out,
// and send back rows.  They need the same files, at the same path, and no folder in common.
#include <mpi.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "commands.h"
#include "program.h"
#include "sweep.h"

namespace {

using dyntape::FromPeer;
using dyntape::SweepCoordinator;
using namespace std::chrono_literals;

// To the others an order: a chunk, or what is below zero; the first is followed by the sweep's identity.
constexpr int kOrder = 1, kIdentity = 2, kNews = 3, kText = 4;
constexpr long kBegin = -1, kDismissed = -2;
constexpr long kGone = -1;  // the last news of a rank

void send(const void* data, std::size_t bytes, int rank, int tag) {
  MPI_Send(data, static_cast<int>(bytes), MPI_BYTE, rank, tag, MPI_COMM_WORLD);
}

bool has_arrived(int rank, int tag, MPI_Status& status) {
  int arrived = 0;
  return MPI_Iprobe(rank, tag, MPI_COMM_WORLD, &arrived, &status) == MPI_SUCCESS && arrived;
}

std::string receive_text(int rank, int tag) {
  MPI_Status status;
  int bytes = 0;
  MPI_Probe(rank, tag, MPI_COMM_WORLD, &status);
  MPI_Get_count(&status, MPI_BYTE, &bytes);
  std::string text(static_cast<std::size_t>(bytes), '\0');
  MPI_Recv(text.data(), bytes, MPI_BYTE, rank, tag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  return text;
}

class Peers : public dyntape::SweepPeers {
 public:
  explicit Peers(int ranks) : ranks_(ranks) {}

  int count() const override { return ranks_ - 1; }
  void begin(const std::string& identity) override {
    for (int rank = 1; rank < ranks_; ++rank) {
      give(rank, kBegin);
      send(identity.data(), identity.size(), rank, kIdentity);
    }
  }
  void give(int rank, long chunk) override { send(&chunk, sizeof chunk, rank, kOrder); }
  void dismiss() override {
    if (is_over_) return;
    for (int rank = 1; rank < ranks_; ++rank) give(rank, kDismissed);
    is_over_ = true;
  }
  std::optional<FromPeer> poll() override {
    MPI_Status status;
    if (!has_arrived(MPI_ANY_SOURCE, kNews, status)) return {};
    std::array<long, 3> head{};
    MPI_Recv(head.data(), sizeof head, MPI_BYTE, status.MPI_SOURCE, kNews, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    if (head[0] == kGone) {
      ++gone_;
      return {};
    }
    return FromPeer{.peer = status.MPI_SOURCE,
                    .what = static_cast<FromPeer::What>(head[0]),
                    .threads = static_cast<unsigned>(head[1]),
                    .done = {head[2], receive_text(status.MPI_SOURCE, kText)}};
  }

  // What ranks still send when they are dismissed is taken and forgotten, or they would wait for ever.  False where one
  // does not say good-bye.
  bool hear_out() {
    dismiss();
    constexpr auto kPatience = 5s;
    const auto begin = std::chrono::steady_clock::now();
    while (gone_ < count() && std::chrono::steady_clock::now() - begin < kPatience) {
      if (!poll()) std::this_thread::sleep_for(1ms);
    }
    return gone_ == count();
  }

 private:
  int ranks_, gone_ = 0;
  bool is_over_ = false;
};

class Master : public SweepCoordinator {
 public:
  std::optional<std::string> begin() override {
    std::optional<Order> order;
    while (!(order = poll())) std::this_thread::sleep_for(2ms);
    if (order->is_dismissed) return {};
    return receive_text(0, kIdentity);
  }
  void tell(const FromPeer& news) override {
    const std::array<long, 3> head{static_cast<long>(news.what), static_cast<long>(news.threads),
                                   news.done.chunk};
    send(head.data(), sizeof head, 0, kNews);
    send(news.done.text.data(), news.done.text.size(), 0, kText);
  }
  std::optional<Order> poll() override {
    if (is_over_) return Order{true, 0};
    MPI_Status status;
    if (!has_arrived(0, kOrder, status)) return {};
    long chunk = 0;
    MPI_Recv(&chunk, sizeof chunk, MPI_BYTE, 0, kOrder, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    is_over_ = chunk == kDismissed;
    return Order{is_over_, chunk};
  }
  void wait_for_the_end() {
    while (!is_over_) {
      if (!poll()) std::this_thread::sleep_for(2ms);
    }
    const std::array<long, 3> head{kGone, 0, 0};
    send(head.data(), sizeof head, 0, kNews);
  }

 private:
  bool is_over_ = false;
};

// Rank 0 says what is wrong with the command line; the others wait for it to send them home.
int serve(int argc, char** argv) {
  using namespace dyntape::tools;
  Master master;
  CLI::App app;
  app.require_subcommand(1);
  add_sweep_command(app, {nullptr, &master});
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError&) {
  }
  master.wait_for_the_end();
  return 0;
}

int lead(int argc, char** argv, int ranks) {
  using namespace dyntape::tools;
  Peers peers(ranks);
  CLI::App app{"dyntape-mpi: a sweep by the processes of mpirun"};
  app.name("dyntape");
  add_sweep_command(app, {&peers, nullptr});
  const int status = run(app, argc, argv);
  if (!peers.hear_out())
    std::_Exit(status);  // what is written is whole; MPI would wait for the rank that is lost
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  dyntape::tools::open_standard_streams();
  int rank = 0, ranks = 1, provided = 0;
  MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &provided);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  const int status = rank == 0 ? lead(argc, argv, ranks) : serve(argc, argv);
  MPI_Finalize();
  return status;
}
