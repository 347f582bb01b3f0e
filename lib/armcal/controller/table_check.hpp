// controller - decodes, checks and builds a table in slices, so that no call takes long.
#pragma once

#include "armcal/estimator/adopted_table.hpp"
#include "armcal/model/ceilings.hpp"
#include "armcal/model/friction_grid.hpp"

namespace armcal::controller {

// The check of one table. Begin, then Step until it no longer answers kBusy. Context: background.
template <class Model>
class TableCheck {
 public:
  static constexpr int n = Model::kJoints;

  // `words` [count]: a table in its layout. It must not change until the end. ceilings, bumpless_allowed,
  // sealed: see model::CheckWords. generation: the number of the coming adoption. suits: says whether the filters can
  // hold what the table asks for. `spare`: the check fills it in; nobody else may use it until the end.
  void Begin(const std::uint16_t* words, int count, const model::CeilingView& ceilings, bool bumpless_allowed,
             bool sealed, std::uint32_t generation, bool (*suits)(const estimator::AdoptedTable<Model>&),
             estimator::AdoptedTable<Model>& spare) {
    words_ = words;
    count_ = count;
    ceilings_ = ceilings;
    bumpless_allowed_ = bumpless_allowed;
    sealed_ = sealed;
    generation_ = generation;
    suits_ = suits;
    spare_ = &spare;
    stage_ = Stage::kWords;
  }

  // One slice. kBusy: call again. kOk: `spare` is ready. Any other answer is a refusal. The checks come in this order,
  // and the first one that refuses ends the check: heading (model::CheckHeading), numbers (model::CheckWords), build
  // (estimator::TableBuild), filters (kOutOfRange: a filter's form cannot hold the table), friction
  // (model::CheckFriction).
  core::Refusal Step() {
    core::Refusal refusal;
    switch (stage_) {
      case Stage::kWords:
        refusal.status = model::CheckHeading<n, Model::kParameters>(words_, count_, Model::kSchema);
        if (core::IsOk(refusal.status)) refusal = model::CheckWords(ceilings_, bumpless_allowed_, words_, sealed_);
        return Next(Stage::kDecode, refusal);
      case Stage::kDecode:
        refusal.status = model::Decode(words_, Model::kSchema, table_);
        build_.Begin(table_, generation_, rigid_, *spare_);
        return Next(Stage::kBuild, refusal);
      case Stage::kBuild:
        refusal.status = build_.Step();
        if (core::IsOk(refusal.status) && !suits_(*spare_)) refusal.status = core::Status::kOutOfRange;
        memory_.running = false;
        point_ = 0;
        return Next(Stage::kFriction, refusal);
      case Stage::kFriction:
        return TryFriction();
    }
    return refusal;
  }

  // Builds the model's defaults into `spare`, at once. They are not compared with the ceilings. Answers as Step.
  core::Status BuildDefaults(std::uint32_t generation, bool (*suits)(const estimator::AdoptedTable<Model>&),
                             estimator::AdoptedTable<Model>& spare) {
    table_ = estimator::DefaultTable<Model>();
    const core::Status built = estimator::BuildAdoptedTable(table_, generation, rigid_, spare);
    return core::IsOk(built) && !suits(spare) ? core::Status::kOutOfRange : built;
  }

 private:
  enum class Stage : std::uint8_t { kWords, kDecode, kBuild, kFriction };
  static constexpr int kPoints = 4;  // of the grid, in a slice

  core::Refusal Next(Stage next, core::Refusal refusal) {
    if (!core::IsOk(refusal.status)) return refusal;
    stage_ = next;
    refusal.status = core::Status::kBusy;
    return refusal;
  }

  core::Refusal TryFriction() {
    core::Refusal refusal;
    constexpr int kAll = model::GridPoints(Model::kFrictionReads, Model::kNonlinear);
    for (int k = 0; k < kPoints && point_ < kAll && core::IsOk(refusal.status); ++k, ++point_)
      refusal = model::CheckFrictionAt(point_, spare_->committed, ceilings_, memory_, rows_);
    if (core::IsOk(refusal.status) && point_ < kAll) refusal.status = core::Status::kBusy;
    return refusal;
  }

  const std::uint16_t* words_ = nullptr;
  model::CeilingView ceilings_ = {};
  bool (*suits_)(const estimator::AdoptedTable<Model>&) = nullptr;
  estimator::AdoptedTable<Model>* spare_ = nullptr;
  estimator::Table<Model> table_;  // the last one that was decoded
  physical::RigidPrior<Model, float> rigid_;
  estimator::TableBuild<Model> build_;
  model::Memory<Model> memory_;
  model::Rows<Model> rows_;
  std::uint32_t generation_ = 0;
  int count_ = 0, point_ = 0;
  bool bumpless_allowed_ = false, sealed_ = false;
  Stage stage_ = Stage::kWords;
};

}  // namespace armcal::controller
