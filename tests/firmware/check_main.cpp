// main() of every suite.
#ifndef __AVR__

#define DOCTEST_CONFIG_IMPLEMENT
#include <ostream>
#include <string>

#include "check.h"

namespace {

// Names each case that passed, in doctest's own form: PlatformIO counts the cases it sees printed.
// doctest's option "success" would print every check, up to 12 000 in a suite: reading them took
// longer than the tests.
class PassedCases : public doctest::IReporter {
 public:
  explicit PassedCases(const doctest::ContextOptions& options) : out_(*options.cout) {}

  void test_case_start(const doctest::TestCaseData& data) override { case_ = &data; }
  void test_case_end(const doctest::CurrentTestCaseStats& stats) override {
    // What failed has been printed, and a case that checked nothing has passed nothing.
    if (stats.testCaseSuccess && stats.numAssertsCurrentTest > 0) {
      out_ << std::string(79, '=') << '\n'
           << case_->m_file.c_str() << ':' << case_->m_line << ":\nTEST CASE:  " << case_->m_name
           << "\n\n"
           << std::flush;  // seen even if the next case takes the program down
    }
  }

  void report_query(const doctest::QueryData&) override {}
  void test_run_start() override {}
  void test_run_end(const doctest::TestRunStats&) override {}
  void test_case_reenter(const doctest::TestCaseData&) override {}
  void test_case_exception(const doctest::TestCaseException&) override {}
  void subcase_start(const doctest::SubcaseSignature&) override {}
  void subcase_end() override {}
  void log_assert(const doctest::AssertData&) override {}
  void log_message(const doctest::MessageData&) override {}
  void test_case_skipped(const doctest::TestCaseData&) override {}

 private:
  std::ostream& out_;
  const doctest::TestCaseData* case_ = nullptr;
};

REGISTER_LISTENER("passed", 1, PassedCases);

}  // namespace

int main(int argc, char** argv) {
  doctest::Context context(argc, argv);
  // PlatformIO takes a non-zero exit for a crash.
  context.setOption("no-exitcode", true);
  return context.run();
}

#else

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <stdlib.h>

#include "check.h"

namespace check {
namespace {

Case* first = nullptr;
Case** end = &first;
bool failed = false;

void put(char letter) {
  while ((UCSR0A & _BV(UDRE0)) == 0) {
  }
  UDR0 = static_cast<uint8_t>(letter);
}

void put_text(const char* text) {
  while (*text != '\0') {
    put(*text++);
  }
}

void put_flash(const char* text_flash) {
  for (char letter = static_cast<char>(pgm_read_byte(text_flash)); letter != '\0';
       letter = static_cast<char>(pgm_read_byte(++text_flash))) {
    put(letter);
  }
}

void put_number(int32_t value) {
  char digits[12];
  put_text(ltoa(value, digits, 10));
}

void put_failure(const char* text_flash, uint16_t line) {
  failed = true;
  put_flash(PSTR("check: note line "));
  put_number(line);
  put_flash(PSTR(": "));
  put_flash(text_flash);
}

}  // namespace

Case::Case(const char* name_in_flash, void (*body_of_case)())
    : name_flash(name_in_flash), body(body_of_case), next(nullptr) {
  *end = this;
  end = &next;
}

void fail(const char* text_flash, uint16_t line) {
  put_failure(text_flash, line);
  put('\n');
}

void fail_equal(const char* text_flash, uint16_t line, int32_t left, int32_t right) {
  put_failure(text_flash, line);
  put_flash(PSTR(" is "));
  put_number(left);
  put_flash(PSTR(" and "));
  put_number(right);
  put('\n');
}

namespace {

void run_all() {
  for (const Case* test = first; test != nullptr; test = test->next) {
    failed = false;
    test->body();
    put_flash(failed ? PSTR("check: fail ") : PSTR("check: pass "));
    put_flash(test->name_flash);
    put('\n');
  }
  put_flash(PSTR("check: done \n"));
}

}  // namespace
}  // namespace check

int main() {
  UBRR0 = 1;  // 1 Mbaud at U2X: the simulator then spends its time on tests, not on bytes
  UCSR0A = _BV(U2X0);
  UCSR0B = _BV(TXEN0);
  check::run_all();
  // simavr ends the program when it sleeps with interrupts off.
  cli();
  sleep_enable();
  sleep_cpu();
  return 0;
}

#endif
