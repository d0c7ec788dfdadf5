#include "thread_pool.hpp"

#if !defined(_WIN32)
#include <unistd.h>
#endif

#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

namespace pneumorph {

namespace {

class ThreadPool {
 public:
  void run(int count, const std::function<void(int)>& job) {
    const std::lock_guard<std::mutex> one_caller(caller_);
    std::unique_lock<std::mutex> lock(mutex_);
    for (; thread_count_ + 1 < count; ++thread_count_) std::thread(&ThreadPool::serve, this, thread_count_ + 1).detach();
    job_ = &job;
    job_count_ = count;
    left_ = count - 1;
    failure_ = nullptr;
    ++round_;
    lock.unlock();
    begin_.notify_all();
    attempt(0, job);
    lock.lock();
    done_.wait(lock, [&] { return left_ == 0; });
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  void attempt(int number, const std::function<void(int)>& job) {
    try {
      job(number);
    } catch (...) {
      const std::lock_guard<std::mutex> guard(mutex_);
      if (!failure_) failure_ = std::current_exception();
    }
  }

  // What thread `number` does for ever: takes part in each round that needs as many.
  void serve(int number) {
    long seen = 0;
    while (true) {
      std::unique_lock<std::mutex> lock(mutex_);
      begin_.wait(lock, [&] { return round_ != seen && left_ > 0; });
      seen = round_;
      if (number >= job_count_) continue;
      const auto* job = job_;
      lock.unlock();
      attempt(number, *job);
      lock.lock();
      if (--left_ == 0) done_.notify_one();
    }
  }

  std::mutex caller_, mutex_;
  std::condition_variable begin_, done_;
  const std::function<void(int)>* job_ = nullptr;
  std::exception_ptr failure_;
  int thread_count_ = 0, job_count_ = 0, left_ = 0;
  long round_ = 0;
};

// Threads do not follow a fork, so a pool is of one process. Windows has no forks.
int current_process() {
#if defined(_WIN32)
  return 1;
#else
  return int(getpid());
#endif
}

}  // namespace

void run_in_threads(int count, const std::function<void(int)>& job) {
  if (count == 1) return job(0);
  // Never destroyed: its threads wait in it until the process ends.
  static std::mutex creation;
  static ThreadPool* pool = nullptr;
  static int owner = 0;
  ThreadPool* mine;
  {
    const std::lock_guard<std::mutex> guard(creation);
    if (owner != current_process()) pool = new ThreadPool, owner = current_process();
    mine = pool;
  }
  mine->run(count, job);
}

}  // namespace pneumorph
