/// A headless Chromium that tests drive as a person would: through its DevTools protocol, over a pipe, without a
/// driver.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include "tests/support/temporary_folder.h"

namespace mbtfm::test {

using nlohmann::json;

inline bool has_browser() { return std::system("command -v chromium >/dev/null 2>&1") == 0; }

class Browser {
 public:
  /// No name of a host resolves.
  Browser() {
    start();
    const std::string target = call("Target.createTarget", {{"url", "about:blank"}})["targetId"];
    session_ = call("Target.attachToTarget", {{"targetId", target}, {"flatten", true}})["sessionId"];
    for (const char* domain : {"Runtime", "Log", "Network", "Page"}) call(domain + std::string(".enable"));
  }
  /// Opens a page in a window of 1000 by 900 px, and waits until it has loaded.
  void open(const std::filesystem::path& page) {
    call("Emulation.setEmulatedMedia", {{"media", ""}});
    resize(1000, 900);
    events_.clear();
    call("Page.navigate", {{"url", "file://" + page.string()}});
    while (std::none_of(events_.begin(), events_.end(),
                        [](const json& e) { return e["method"] == "Page.loadEventFired"; }))
      receive();
    settle();
  }
  ~Browser() {
    ::kill(process_, SIGTERM);
    ::waitpid(process_, nullptr, 0);
    for (const int end : {to_, from_}) ::close(end);
  }
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  void resize(int width_px, int height_px) {
    call("Emulation.setDeviceMetricsOverride",
         {{"width", width_px}, {"height", height_px}, {"deviceScaleFactor", 1}, {"mobile", false}});
    settle();
  }

  /// Value of an expression in the page.
  json evaluate(const std::string& expression) {
    const json answer =
        call("Runtime.evaluate", {{"expression", expression}, {"returnByValue", true}, {"awaitPromise", true}});
    if (answer.contains("exceptionDetails")) throw std::runtime_error(answer["exceptionDetails"].dump());
    return answer["result"].value("value", json());
  }

  /// `type` as the protocol calls it: mouseMoved, mousePressed, mouseReleased, mouseWheel.
  void mouse(const std::string& type, double x, double y, json more = json::object()) {
    more.update({{"type", type}, {"x", x}, {"y", y}});
    call("Input.dispatchMouseEvent", more);
    settle();
  }
  void click(double x, double y, int times = 1) {
    for (int i = 1; i <= times; ++i) {
      const json left = {{"button", "left"}, {"clickCount", i}};
      mouse("mousePressed", x, y, left);
      mouse("mouseReleased", x, y, left);
    }
  }

  /// Two frames: what follows from an event has been drawn.
  void settle() {
    evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 30))))");
  }

  json call(const std::string& method, const json& parameters = json::object()) {
    json message = {{"id", ++last_id_}, {"method", method}, {"params", parameters}};
    if (!session_.empty()) message["sessionId"] = session_;
    const std::string text = message.dump() + '\0';
    if (::write(to_, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
      throw std::runtime_error("Chromium does not listen");
    for (;;) {
      const json answer = receive();
      if (answer.value("id", 0) != last_id_) continue;
      if (answer.contains("error")) throw std::runtime_error(method + ": " + answer["error"].dump());
      return answer["result"];
    }
  }

  /// Errors, warnings and messages of the page's scripts, since it was opened.
  std::vector<std::string> console() const {
    std::vector<std::string> lines;
    for (const json& e : events_) {
      const std::string method = e["method"];
      if (method == "Runtime.consoleAPICalled" || method == "Runtime.exceptionThrown" || method == "Log.entryAdded")
        lines.push_back(e["params"].dump());
    }
    return lines;
  }
  /// Addresses that the page asked for.
  std::vector<std::string> requests() const {
    std::vector<std::string> addresses;
    for (const json& e : events_)
      if (e["method"] == "Network.requestWillBeSent") addresses.push_back(e["params"]["request"]["url"]);
    return addresses;
  }

 private:
  void start() {
    std::array<int, 2> in{}, out{};
    if (::pipe(in.data()) != 0 || ::pipe(out.data()) != 0) throw std::runtime_error("no pipe");
    const std::string profile = "--user-data-dir=" + (profile_ / "profile").string();
    process_ = ::fork();
    if (process_ == 0) {
      // the protocol's ends are 3 and 4; first out of their way
      const int read_end = ::fcntl(in[0], F_DUPFD, 20), write_end = ::fcntl(out[1], F_DUPFD, 20);
      ::dup2(read_end, 3);
      ::dup2(write_end, 4);
      for (int i = 5; i < 64; ++i) ::close(i);
      const int nothing = ::open("/dev/null", O_RDWR);
      for (const int i : {0, 1, 2}) ::dup2(nothing, i);
      ::execlp("chromium", "chromium", "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic",
               "--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run",
               "--host-resolver-rules=MAP * ~NOTFOUND", "--remote-debugging-pipe", profile.c_str(), nullptr);
      ::_exit(127);
    }
    ::close(in[0]);
    ::close(out[1]);
    to_ = in[1];
    from_ = out[0];
  }

  json receive() {
    std::size_t end;
    while ((end = buffer_.find('\0')) == buffer_.npos) {
      pollfd waiting{from_, POLLIN, 0};
      constexpr int kPatience_ms = 60000;  // of a machine under load
      char block[65536];
      const ssize_t n = ::poll(&waiting, 1, kPatience_ms) == 1 ? ::read(from_, block, sizeof block) : 0;
      if (n <= 0) throw std::runtime_error("Chromium does not answer");
      buffer_.append(block, static_cast<std::size_t>(n));
    }
    json message = json::parse(buffer_.substr(0, end));
    buffer_.erase(0, end + 1);
    if (message.contains("method")) events_.push_back(message);
    return message;
  }

  TemporaryFolder profile_;
  pid_t process_ = -1;
  int to_ = -1, from_ = -1, last_id_ = 0;
  std::string session_, buffer_;
  std::vector<json> events_;
};

}  // namespace mbtfm::test
