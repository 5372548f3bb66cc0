// softarm eval: the model's terms for given states, to compare with other programs.
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "apps/softarm/commands.hpp"
#include "apps/softarm/eval_case.hpp"

namespace softarm {
namespace {

using Json = nlohmann::ordered_json;

Json vector_json(const Eigen::Ref<const Eigen::VectorXd>& v) {
  return std::vector<double>(v.begin(), v.end());
}

Json matrix_json(const Eigen::MatrixXd& m) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < m.rows(); ++i) rows.push_back(vector_json(m.row(i).transpose()));
  return rows;
}

Json term_json(const EvalTerm& term) {
  bool finite = !term.matrices.empty();
  for (const auto& m : term.matrices) finite = finite && m.allFinite();
  if (!finite) return nullptr;
  switch (term.shape) {
    case EvalTerm::Shape::number:
      return term.matrices.front()(0, 0);
    case EvalTerm::Shape::vector:
      return vector_json(term.matrices.front().col(0));
    case EvalTerm::Shape::matrix:
      return matrix_json(term.matrices.front());
    case EvalTerm::Shape::list:
    case EvalTerm::Shape::vectors:
      break;
  }
  Json list = Json::array();
  for (const auto& m : term.matrices) {
    list.push_back(term.shape == EvalTerm::Shape::list ? matrix_json(m) : vector_json(m.col(0)));
  }
  return list;
}

std::string evaluate_file(const std::string& file, MassModel mass, EvalMethod method) {
  Json cases = Json::array();
  for (EvalCase& one : read_eval_cases(file)) {
    one.arm.mass = mass;
    Json& terms = cases.emplace_back(Json{{"id", one.id}});
    for (const NamedTerm& term : evaluate(one, method)) {
      terms[Json::json_pointer("/" + term.name)] = term_json(term.term);
    }
  }
  return Json{{"cases", std::move(cases)}}.dump() + "\n";
}

}  // namespace

void add_eval_command(CLI::App& app) {
  struct Options {
    std::string file;
    std::string mass = "point";
    std::string method = "direct";
  };
  auto options = std::make_shared<Options>();
  auto* command = app.add_subcommand("eval", "Print every term of the model for given states");
  command->add_option("FILE", options->file, "cases as JSON or YAML, see tests/golden/golden.json")
      ->required();
  command->add_option("--mass", options->mass, "where a segment's mass sits: point, distributed")
      ->check(CLI::IsMember({"point", "distributed"}))
      ->capture_default_str();
  command
      ->add_option("--method", options->method,
                   "the route of evaluation: direct, or augmented (polar, point)")
      ->check(CLI::IsMember({"direct", "augmented"}))
      ->capture_default_str();
  command->callback([options] {
    const MassModel mass = options->mass == "point" ? MassModel::point : MassModel::distributed;
    const EvalMethod method =
        options->method == "direct" ? EvalMethod::direct : EvalMethod::augmented;
    try {
      const std::string text = evaluate_file(options->file, mass, method);
      std::fwrite(text.data(), 1, text.size(), stdout);
    } catch (const std::invalid_argument& error) {
      throw CLI::ValidationError("--method", error.what());
    }
  });
}

}  // namespace softarm
